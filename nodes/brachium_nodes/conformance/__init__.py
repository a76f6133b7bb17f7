"""Whether a node keeps to docs/node-protocol.md: any command that starts one is tried from outside."""
