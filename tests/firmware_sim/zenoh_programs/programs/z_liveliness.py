"""Is alive."""

import time

import zenoh


def main(conf: zenoh.Config, key: str):
    zenoh.init_log_from_env_or("error")
    with zenoh.open(conf) as session, session.liveliness().declare_token(key):
        while True:
            time.sleep(1)


if __name__ == "__main__":
    import common

    parser = common.parser("zenoh liveliness example")
    parser.add_argument("--key", "-k", default="group1/zenoh-py")
    args = parser.parse_args()
    main(common.config(args), args.key)
