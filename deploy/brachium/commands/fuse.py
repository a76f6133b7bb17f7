"""Run fusion: sensor samples in, skeletons out.

brachium fuse --filter vqf --rate 50
"""

import argparse

from brachium.option_types import folder, real
from brachium.shell import add_network, serve

FILTERS = ("auto", "vqf", "complementary", "complementary-printed")
"""As fusion knows them; help loads nothing heavy."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add fusion's options."""
    add_network(parser)
    parser.add_argument("--id", default="fusion", help="this service's name")
    parser.add_argument("--filter", default="auto", choices=FILTERS, help="of orientation")
    parser.add_argument("--no-mag", action="store_true", help="leave magnetometers aside")
    parser.add_argument(
        "--rate", type=real(1.0, 1000.0), default=50.0, metavar="HZ", help="skeletons a second"
    )
    parser.add_argument("--no-auto-pose", action="store_true", help="calibrate only when asked to")
    parser.add_argument(
        "--keep", type=folder, metavar="DIR", help="where calibrations are kept (default: the user's state)"
    )
    parser.add_argument("--no-keep", action="store_true", help="keep no calibration")
    parser.add_argument("--no-joints", action="store_true", help="leave aside what joints tell: less work")
    parser.add_argument("--no-shoulder", action="store_true", help="do not follow the shoulder: less work")


def run(args: argparse.Namespace) -> int:
    """Start fusion."""
    from brachium_fusion import service
    from brachium_fusion.kept import state_folder
    from brachium_fusion.settings import Settings

    pipeline = Settings(
        filter=args.filter,
        magnetometer=not args.no_mag,
        rate_hz=args.rate,
        auto_pose=not args.no_auto_pose,
        joints=not args.no_joints,
        shoulder=not args.no_shoulder,
    )
    keep = None if args.no_keep else args.keep or state_folder()
    settings = service.FuseSettings(
        endpoint=args.endpoint, room=args.room, service_id=args.id, pipeline=pipeline, keep=keep
    )
    return serve(lambda stop: service.run(settings, stop))
