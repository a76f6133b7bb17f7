"""SlimeVR trackers as nodes: datagrams of UDP port 6969 in, orientation samples on the bus out."""
