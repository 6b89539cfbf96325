"""Asks once, prints the replies."""

import zenoh


def main(conf: zenoh.Config, selector: str, target: zenoh.QueryTarget, payload: str | None, timeout: float):
    zenoh.init_log_from_env_or("error")
    with zenoh.open(conf) as session:
        print(f"Sending Query '{selector}'...")
        for reply in session.get(selector, target=target, payload=payload, timeout=timeout):
            try:
                print(f">> Received ('{reply.ok.key_expr}': '{reply.ok.payload.to_string()}')")
            except AttributeError:
                print(f">> Received (ERROR: '{reply.err.payload.to_string()}')")


if __name__ == "__main__":
    import common

    parser = common.parser("zenoh get example")
    parser.add_argument("--selector", "-s", default="demo/example/**")
    parser.add_argument("--target", "-t", choices=["ALL", "BEST_MATCHING", "ALL_COMPLETE"], default="BEST_MATCHING")
    parser.add_argument("--payload", "-p")
    parser.add_argument("--timeout", "-o", default=10.0, type=float)
    args = parser.parse_args()
    main(common.config(args), args.selector, getattr(zenoh.QueryTarget, args.target), args.payload, args.timeout)
