"""Say what works on this machine, what does not, and what to do.

brachium doctor
"""

import argparse
import logging

from brachium.shell import add_json, print_json


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the doctor's options."""
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Examine and tell; 1 when something that everything needs is broken."""
    from brachium.checks import examine

    if not args.verbose:
        logging.getLogger("brachium_router").setLevel(logging.WARNING)  # of the router that is tried
    findings = examine()
    if args.json:
        print_json(findings)
    else:
        mark = {"ok": "works", "limited": "limited", "broken": "BROKEN"}
        for finding in findings:
            print(f"{mark[finding.state]:<8}{finding.name}: {finding.text}")
            if finding.to_do:
                print(f"{'':<8}  {finding.to_do}")
    return 1 if any(finding.state == "broken" for finding in findings) else 0
