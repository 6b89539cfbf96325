"""Asks each second, prints the replies."""

import itertools
import time

import zenoh


def main(conf: zenoh.Config, selector: str, target: zenoh.QueryTarget, payload: str, number: int | None):
    zenoh.init_log_from_env_or("error")
    with zenoh.open(conf) as session:
        asked = zenoh.Selector(selector)
        querier = session.declare_querier(asked.key_expr, target=target, timeout=10.0)
        for index in itertools.count() if number is None else range(number):
            time.sleep(1.0)
            text = f"[{index:4d}] {payload}"
            print(f"Querying '{selector}' with payload '{text}'...")
            for reply in querier.get(parameters=asked.parameters, payload=text):
                try:
                    print(f">> Received ('{reply.ok.key_expr}': '{reply.ok.payload.to_string()}')")
                except AttributeError:
                    print(f">> Received (ERROR: '{reply.err.payload.to_string()}')")


if __name__ == "__main__":
    import common

    parser = common.parser("zenoh querier example")
    parser.add_argument("--selector", "-s", default="demo/example/**")
    parser.add_argument("--payload", "-p", default="")
    parser.add_argument("--iter", type=int)
    args = parser.parse_args()
    main(common.config(args), args.selector, zenoh.QueryTarget.BEST_MATCHING, args.payload, args.iter)
