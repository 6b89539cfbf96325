"""Prints who comes and goes."""

import zenoh


def main(conf: zenoh.Config, key: str, history: bool):
    zenoh.init_log_from_env_or("error")
    with zenoh.open(conf) as session, session.liveliness().declare_subscriber(key, history=history) as subscriber:
        for sample in subscriber:
            if sample.kind == zenoh.SampleKind.PUT:
                print(f">> [LivelinessSubscriber] New alive token ('{sample.key_expr}')")
            elif sample.kind == zenoh.SampleKind.DELETE:
                print(f">> [LivelinessSubscriber] Dropped token ('{sample.key_expr}')")


if __name__ == "__main__":
    import common

    parser = common.parser("zenoh liveliness subscriber example")
    parser.add_argument("--key", "-k", default="group1/**")
    parser.add_argument("--history", action="store_true")
    args = parser.parse_args()
    main(common.config(args), args.key, args.history)
