"""Prints who is alive."""

import zenoh


def main(conf: zenoh.Config, key: str, timeout: float):
    zenoh.init_log_from_env_or("error")
    with zenoh.open(conf) as session:
        for reply in session.liveliness().get(key, timeout=timeout):
            try:
                print(f">> Alive token ('{reply.ok.key_expr}')")
            except AttributeError:
                print(f">> Received (ERROR: '{reply.err.payload.to_string()}')")


if __name__ == "__main__":
    import common

    parser = common.parser("zenoh liveliness query example")
    parser.add_argument("--key", "-k", default="group1/**")
    parser.add_argument("--timeout", "-o", default=10.0, type=float)
    args = parser.parse_args()
    main(common.config(args), args.key, args.timeout)
