"""Live views, recorder, monitor, summaries: everything that looks at the network and sends nothing back."""
