"""A Zenoh program that knows nothing of marconet, in a process of its own; it does what lines of its input say.

    python zenoh_client.py ENDPOINT [MODE] [SETTINGS as JSON]

    sub KEY | pub KEY COUNT PERIOD_S [BYTES] | put KEY TEXT | delete KEY | queryable KEY TEXT [complete] | get SELECTOR
    TIMEOUT_S [TARGET] | token KEY | liveliness KEY | alive KEY | matching KEY | close
"""

import json
import sys
import threading
import time

import zenoh

SAYING = threading.Lock()


def say(*words):
    with SAYING:
        print(*words, flush=True)


def main():
    config = zenoh.Config()
    mode = sys.argv[2] if len(sys.argv) > 2 else "client"
    more = json.loads(sys.argv[3]) if len(sys.argv) > 3 else {}
    for key, value in {"mode": mode, "connect/endpoints": [sys.argv[1]], "connect/timeout_ms": 10_000,
                       "scouting/multicast/enabled": False, **more}.items():
        config.insert_json5(key, json.dumps(value))
    held = []
    with zenoh.open(config) as session:
        say("open")
        for line in sys.stdin:
            verb, *words = line.split()
            if verb == "close":
                break
            act(session, held, verb, words)
    say("closed")


def act(session, held, verb, words):
    key = words[0]
    match verb:
        case "sub":
            held.append(session.declare_subscriber(key, lambda s: say(
                "heard", s.key_expr, s.payload.to_string() if s.kind == zenoh.SampleKind.PUT else "DELETED", s.encoding,
                "-" if s.attachment is None else s.attachment.to_string(), str(s.priority).partition(".")[2],
                "-" if s.timestamp is None else s.timestamp, f"{time.time():.6f}")))
        case "pub":
            publisher = session.declare_publisher(key, congestion_control=zenoh.CongestionControl.BLOCK)
            start_s = time.monotonic()
            for k in range(int(words[1])):
                time.sleep(max(0.0, start_s + k * float(words[2]) - time.monotonic()))
                publisher.put(f"{k} {time.time():.6f}".ljust(int(words[3]) if len(words) > 3 else 0))
            say("published")
        case "put":
            stamp = session.new_timestamp()
            session.put(key, words[1], encoding="text/plain;own", attachment="attached", timestamp=stamp,
                        priority=zenoh.Priority.INTERACTIVE_HIGH,
                        congestion_control=zenoh.CongestionControl.BLOCK)     # else a busy machine may lose it here
            say("put", stamp)
        case "delete":
            session.delete(key)
        case "queryable":
            def answer(query):
                payload = "" if query.payload is None else query.payload.to_string()
                query.reply(words[0], f"{words[1]}({query.parameters},{payload})")

            held.append(session.declare_queryable(key, answer, complete="complete" in words))
        case "get":
            target = getattr(zenoh.QueryTarget, words[2] if len(words) > 2 else "BEST_MATCHING")
            begun_s = time.monotonic()
            for reply in session.get(key, timeout=float(words[1]), target=target, payload="asked"):
                if reply.ok is not None:
                    say("reply", reply.ok.key_expr, reply.ok.payload.to_string())
                else:
                    say("error", reply.err.payload.to_string())
            say("got", f"{time.monotonic() - begun_s:.3f}")
        case "token":
            held.append(session.liveliness().declare_token(key))
        case "liveliness":
            held.append(session.liveliness().declare_subscriber(key, lambda s: say(
                "alive" if s.kind == zenoh.SampleKind.PUT else "dropped", s.key_expr), history=True))
        case "alive":
            say("alive now", *sorted(str(reply.ok.key_expr) for reply in session.liveliness().get(key, timeout=5.0)))
        case "matching":
            publisher = session.declare_publisher(key)
            held.append(publisher)
            held.append(publisher.declare_matching_listener(lambda status: say("matching", status.matching)))
            say("matching", publisher.matching_status.matching)
    if verb not in ("get", "matching"):
        say("done", verb)


if __name__ == "__main__":
    main()
