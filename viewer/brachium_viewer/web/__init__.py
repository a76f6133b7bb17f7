"""The pages in a browser: what they show is worked out here, what they draw is under pages/."""
