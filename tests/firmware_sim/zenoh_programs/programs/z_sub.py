"""Prints what it receives."""

import time

import zenoh


def main(conf: zenoh.Config, key: str):
    zenoh.init_log_from_env_or("error")
    with zenoh.open(conf) as session:
        def listener(sample: zenoh.Sample):
            print(f">> [Subscriber] Received {sample.kind} ('{sample.key_expr}': '{sample.payload.to_string()}')")

        session.declare_subscriber(key, listener)
        while True:
            time.sleep(1)


if __name__ == "__main__":
    import common

    parser = common.parser("zenoh sub example")
    parser.add_argument("--key", "-k", default="demo/example/**")
    args = parser.parse_args()
    main(common.config(args), args.key)
