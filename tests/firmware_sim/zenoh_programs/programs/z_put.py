"""Puts one value."""

import zenoh


def main(conf: zenoh.Config, key: str, payload: str):
    zenoh.init_log_from_env_or("error")
    with zenoh.open(conf) as session:
        print(f"Putting Data ('{key}': '{payload}')...")
        session.put(key, payload)


if __name__ == "__main__":
    import common

    parser = common.parser("zenoh put example")
    parser.add_argument("--key", "-k", default="demo/example/zenoh-python-put")
    parser.add_argument("--payload", "-p", default="Put from Python!")
    args = parser.parse_args()
    main(common.config(args), args.key, args.payload)
