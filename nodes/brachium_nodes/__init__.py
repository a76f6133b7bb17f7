"""What a person wears, and what stands for it: gateway, node protocol, emulated wearer, playback."""
