"""Files that open in other people's tools: one module a format, all from one value, `motion.Motion`."""
