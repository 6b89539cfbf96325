"""What every other room builds on: the event list, frames and their fates, names of links, random streams."""
