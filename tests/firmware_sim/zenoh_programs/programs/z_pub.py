"""Publishes a value each second; tells when somebody listens."""

import itertools
import time

import zenoh


def main(conf: zenoh.Config, key: str, payload: str, number: int | None, interval: float, matching: bool):
    zenoh.init_log_from_env_or("error")
    with zenoh.open(conf) as session:
        publisher = session.declare_publisher(key)
        if matching:
            def on_change(status: zenoh.MatchingStatus):
                print("Publisher has matching subscribers." if status.matching
                      else "Publisher has NO MORE matching subscribers")

            publisher.declare_matching_listener(on_change)
        for index in itertools.count() if number is None else range(number):
            time.sleep(interval)
            text = f"[{index:4d}] {payload}"
            print(f"Putting Data ('{key}': '{text}')...")
            publisher.put(text)


if __name__ == "__main__":
    import common

    parser = common.parser("zenoh pub example")
    parser.add_argument("--key", "-k", default="demo/example/zenoh-python-pub")
    parser.add_argument("--payload", "-p", default="Pub from Python!")
    parser.add_argument("--iter", type=int)
    parser.add_argument("--interval", type=float, default=1.0)
    parser.add_argument("--add-matching-listener", action="store_true")
    args = parser.parse_args()
    main(common.config(args), args.key, args.payload, args.iter, args.interval, args.add_matching_listener)
