"""What all tests share."""

from hypothesis import HealthCheck, settings

# Tests judge counts and orderings, never time: a busy machine must not fail them.
settings.register_profile("any-machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any-machine")
