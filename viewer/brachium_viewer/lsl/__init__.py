"""Lab Streaming Layer: the room as LSL streams, and markers of other LSL programs as events of the room."""
