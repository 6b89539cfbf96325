"""The event list, frames and their fates, names of links and random streams, which the rooms above import."""
