"""Answers queries."""

import time

import zenoh


def main(conf: zenoh.Config, key: str, payload: str, complete: bool):
    zenoh.init_log_from_env_or("error")

    def answer(query: zenoh.Query):
        print(f">> [Queryable ] Received Query '{query.selector}'"
              + (f" with payload: {query.payload.to_string()}" if query.payload is not None else ""))
        query.reply(key, payload)

    with zenoh.open(conf) as session:
        session.declare_queryable(key, answer, complete=complete)
        while True:
            time.sleep(1)


if __name__ == "__main__":
    import common

    parser = common.parser("zenoh queryable example")
    parser.add_argument("--key", "-k", default="demo/example/zenoh-python-queryable")
    parser.add_argument("--payload", "-p", default="Queryable from Python!")
    parser.add_argument("--complete", action="store_true")
    args = parser.parse_args()
    main(common.config(args), args.key, args.payload, args.complete)
