"""Sensing: bodies offer their poses, observers request looks, and receive what their cameras detect."""
