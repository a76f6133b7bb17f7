"""The accuracy tables: both papers' experiments on emulated wearers, and real recordings."""
