"""A node: its event loop, its ports, and the guard that refuses its program other ways to communicate."""
