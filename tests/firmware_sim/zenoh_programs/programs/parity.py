"""Pairs of plain Zenoh programs that tell what they see; each runs on the library and in virtual time.

`left` waits where it has to, so that what it tells does not depend on time; `right` lives until it is done.
"""

import json
import os
import time

import zenoh


def conf():
    config = zenoh.Config()
    for key, value in json.loads(os.environ.get("ZENOH_PARITY", "{}")).items():
        config.insert_json5(key, json.dumps(value))
    return config


def tell(*what):
    print("TOLD", *what, flush=True)


def sample(found):
    return (str(found.key_expr), found.payload.to_string(), str(found.kind), str(found.encoding),
            found.attachment and found.attachment.to_string(), str(found.priority), str(found.congestion_control),
            found.express, found.timestamp is not None)


def reply(found):
    if found.ok:
        return ("ok", *sample(found.ok))
    if found.err.payload.to_string() == "Timeout":      # of the session or of its transport, whichever is first
        return ("err", "Timeout")
    return ("err", found.err.payload.to_string(), str(found.err.encoding), found.replier_id is None)


def attempt(name, call):
    try:
        tell(name, call())
    except Exception as error:
        tell(name, type(error).__name__, str(error).partition(" at /")[0])


def wait_for(holds):
    for _ in range(600):
        if holds():
            return
        time.sleep(0.02)
    raise AssertionError("waited in vain")


def stay(session):
    """Live until the other one says that it is done."""
    with session.declare_subscriber("done") as done:
        done.recv()
    time.sleep(0.2)


def bye(session):
    publisher = session.declare_publisher("done")
    wait_for(lambda: publisher.matching_status.matching)
    publisher.put("")
    time.sleep(0.3)


# --- publications

def puts_left():
    with zenoh.open(conf()) as session:
        publisher = session.declare_publisher("p/a", encoding="text/plain", priority=zenoh.Priority.DATA_HIGH,
                                              congestion_control=zenoh.CongestionControl.BLOCK, express=True)
        tell(publisher.key_expr, publisher.encoding, publisher.priority, publisher.congestion_control)
        wait_for(lambda: publisher.matching_status.matching)
        time.sleep(0.5)
        publisher.put("one")
        publisher.put(b"two", encoding="application/json", attachment="with")
        publisher.delete(attachment=b"gone")
        session.put("p/b", "three", timestamp=session.new_timestamp())
        session.put("p/b/c", zenoh.ZBytes("four"), encoding=zenoh.Encoding("own/type;schema"))
        session.put("elsewhere", "unheard")
        session.delete("p/b")
        for number in range(20):
            session.put("p/many", str(number))
        session.put("p/end", "x" * 5000)
        bye(session)
        publisher.undeclare()
        attempt("undeclared", lambda: publisher.put("late"))
        attempt("undeclared twice", publisher.undeclare)
        attempt("undeclared key", lambda: publisher.key_expr)
        attempt("bad key", lambda: session.put("a//b", "x"))
        attempt("bad payload", lambda: session.put("a", 3))
        attempt("bad handler", lambda: session.declare_subscriber("a", 3))
        attempt("unknown argument", lambda: isinstance(session.put, object) and None)
    tell("closed", session.is_closed())
    attempt("closed put", lambda: session.put("a", "b"))
    attempt("closed get", lambda: session.get("a"))
    attempt("closed declare", lambda: session.declare_subscriber("a"))


def puts_right():
    with zenoh.open(conf()) as session:
        calls, ring, fifo = [], session.declare_subscriber("p/many", zenoh.handlers.RingChannel(3)), None
        fifo = session.declare_subscriber("p/**", zenoh.handlers.FifoChannel(100))
        session.declare_subscriber("p/*", lambda found: calls.append(sample(found)[:2]))
        pair = session.declare_subscriber("p/a", (lambda found: None, "mine"))
        tell(pair.handler, type(ring).__name__, type(ring.handler).__name__, ring.key_expr)
        for found in fifo:
            tell(*sample(found)[:1], len(sample(found)[1]), *sample(found)[2:])
            if str(found.key_expr) == "p/end":
                break
        time.sleep(0.2)
        tell(calls)
        tell([sample(found)[1] for found in iter(ring.try_recv, None)])
        attempt("empty", ring.try_recv)
        ring.undeclare()
        attempt("undeclared", ring.recv)
        stay(session)
        handler = fifo.handler
        fifo.undeclare()
        attempt("closed channel", handler.recv)
        tell(list(handler))


# --- queries

def queries_left():
    with zenoh.open(conf()) as session:
        attempt("nobody", lambda: list(session.get("nobody", timeout=5)))
        nothing = session.get("nobody")
        time.sleep(0.1)
        attempt("ended", nothing.recv)
        attempt("ended", nothing.try_recv)
        querier = session.declare_querier("q/**", target=zenoh.QueryTarget.ALL)
        wait_for(lambda: querier.matching_status.matching)
        time.sleep(0.5)
        for selector in ("q/one", "q/err", "q/del", "q/other", "q/silent", "q/raises", "q/many", "q/twice?x=1;y=2"):
            tell(selector, sorted(map(reply, session.get(selector))))
        for mode in ("NONE", "MONOTONIC", "LATEST", "AUTO"):
            tell(mode, sorted(map(reply, session.get("q/many",
                                                     consolidation=getattr(zenoh.ConsolidationMode, mode)))))
        tell("range", sorted(map(reply, session.get("q/many?_time=[now(-1h)..]"))))
        tell("value", list(map(reply, session.get("q/echo?p=1", payload="in", encoding="text/plain",
                                                  attachment="beside"))))
        tell("any", list(map(reply, session.get("q/other", accept_replies=zenoh.ReplyKeyExpr.ANY))))
        tell("slow", list(map(reply, session.get("q/slow", timeout=0.2))))
        tell("partly", sorted(map(reply, session.get("q/partly", timeout=0.2))))
        tell("complete", list(session.get("q/one", target=zenoh.QueryTarget.ALL_COMPLETE)))
        tell("querier", sorted(map(reply, querier.get(parameters="a=1", payload="v")))[:1])
        got = []
        session.get("q/one", lambda found: got.append(reply(found)))
        wait_for(lambda: got)
        tell("callback", got)
        bye(session)
        querier.undeclare()
        attempt("undeclared", querier.get)


def queries_right():
    kept = []

    def answer(query):
        name = str(query.key_expr).partition("/")[2]
        tell(name, str(query.selector), query.payload and query.payload.to_string(), str(query.encoding),
             query.attachment and query.attachment.to_string(), str(query.accepts_replies()))
        if name == "err":
            query.reply_err("wrong", encoding="text/plain")
        elif name == "del":
            query.reply_del("q/del", attachment="why")
        elif name == "other":
            attempt("reply", lambda: query.reply("other", "elsewhere"))
        elif name == "raises":
            raise RuntimeError("in a callback")
        elif name == "many":
            with query:
                query.reply("q/many", "first")
                query.reply("q/many", "second")
            attempt("dropped", lambda: query.reply("q/many", "third"))
            attempt("dropped key", lambda: query.key_expr)
        elif name == "echo":
            query.reply("q/echo", query.payload, encoding=query.encoding, attachment=query.attachment)
        elif name in ("slow", "partly"):
            kept.append(query)
            if name == "partly":
                query.reply("q/partly", "so far")
        elif name not in ("silent", "**"):
            query.reply(query.key_expr, "yes")
        elif name == "**":
            query.reply("q/a", "for all")

    with zenoh.open(conf()) as session:
        queryable = session.declare_queryable("q/**", answer)
        tell(queryable.key_expr, type(queryable).__name__)
        stay(session)
        queryable.undeclare()
        attempt("undeclared", queryable.undeclare)


# --- liveliness and matching

def alive_left():
    with zenoh.open(conf()) as session:
        liveliness = session.liveliness()
        token = liveliness.declare_subscriber("live/other", history=True)
        tell(sample(token.recv()))
        time.sleep(0.5)
        without = liveliness.declare_subscriber("live/**")
        tell(without.try_recv())
        history = liveliness.declare_subscriber("live/**", history=True)
        tell(sorted(sample(history.recv())[0] for _ in range(2)))
        tell(sorted(reply(found)[1] for found in liveliness.get("live/*")))
        tell(list(liveliness.get("nothing/*")))
        mine = liveliness.declare_token("live/mine")
        tell(sample(history.recv())[:3])
        mine.undeclare()
        tell(sample(history.recv())[:3])
        attempt("undeclared", mine.undeclare)
        publisher = session.declare_publisher("go")
        changes = publisher.declare_matching_listener()
        tell(changes.recv().matching, publisher.matching_status.matching)
        publisher.put("on")
        tell([sample(history.recv())[:3] for _ in range(2)])
        tell(changes.recv().matching)
        bye(session)


def alive_right():
    with zenoh.open(conf()) as session:
        liveliness = session.liveliness()
        one, same = liveliness.declare_token("live/one"), liveliness.declare_token("live/one")
        other = liveliness.declare_token("live/other")
        with session.declare_subscriber("go") as go:
            go.recv()
            time.sleep(0.3)
        same.undeclare()
        time.sleep(0.2)
        one.undeclare()
        time.sleep(0.5)
        del other
        stay(session)


# --- within one session

def alone():
    with zenoh.open(conf()) as session:
        got = []
        session.declare_subscriber("own", zenoh.handlers.Callback(
            lambda found: got.append(sample(found)[1]), lambda: got.append("dropped")))
        remote = session.declare_subscriber("own", allowed_origin=zenoh.Locality.REMOTE)
        here = session.declare_subscriber("own", allowed_origin=zenoh.Locality.SESSION_LOCAL)
        session.put("own", "1")
        session.put("own", "2", allowed_destination=zenoh.Locality.REMOTE)
        session.put("own", "3", allowed_destination=zenoh.Locality.SESSION_LOCAL)
        time.sleep(0.2)
        tell(got, remote.try_recv(), [sample(found)[1] for found in iter(here.try_recv, None)])
        queryable = session.declare_queryable("own/q", complete=True)
        replies = session.get("own/q", timeout=5)
        with queryable.recv() as query:
            tell(str(query.selector))
            query.reply("own/q", "mine")
        tell(list(map(reply, replies)))
        tell(isinstance(session, zenoh.Session), isinstance(here, zenoh.Subscriber), isinstance(query, zenoh.Query))
        key = session.declare_keyexpr("own/key")
        session.put(key, "x")
        session.undeclare(key)
        tell(str(key), str(session.zid()) == str(session.info.zid()), session.info.routers_zid())
        direct = []
        session.declare_subscriber("direct", zenoh.handlers.Callback(direct.append, indirect=False))
        session.put("direct", "now")
        tell(len(direct))
        tell(zenoh.ext.z_deserialize(int, zenoh.ext.z_serialize(5)))
        first, second = session.new_timestamp(), session.new_timestamp()
        tell(second >= first, first == second, first.get_id() == second.get_id())
