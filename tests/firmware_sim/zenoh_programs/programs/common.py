"""Arguments that all examples have, after the description of the library's own examples."""

import json

import zenoh


def parser(description):
    import argparse

    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--mode", "-m", choices=["peer", "client"])
    parser.add_argument("--connect", "-e", action="append")
    parser.add_argument("--listen", "-l", action="append")
    parser.add_argument("--no-multicast-scouting", action="store_true")
    return parser


def config(args):
    conf = zenoh.Config()
    for key, value in (("mode", args.mode), ("connect/endpoints", args.connect), ("listen/endpoints", args.listen)):
        if value is not None:
            conf.insert_json5(key, json.dumps(value))
    if args.no_multicast_scouting:
        conf.insert_json5("scouting/multicast/enabled", "false")
    return conf
