from __future__ import annotations

from hashlib import blake2b
from random import Random

from scipy import stats

from netem.core.random_streams import stream


def test_a_stream_is_the_same_on_every_run_and_version_of_python():
    draws = stream(7, "impairments[0]/radio: a -> b")

    assert [draws.random() for _ in range(3)] == [0.271428101756752, 0.6292034220865561, 0.7109398073069827]



def test_the_name_is_hashed_into_the_integer_seed():
    digest = blake2b(b"7/uplink", digest_size=32).hexdigest()

    assert stream(7, "uplink").random() == Random(int(digest, 16)).random()


def test_seeds_and_places_do_not_share_draws():
    first = {stream(seed, place).random() for seed in range(50) for place in ("a", "b", "ab", "a/b", "1/a")}

    assert len(first) == 250


def test_first_draws_of_neighbouring_places_are_uniform_and_unrelated():
    first = [stream(7, f"impairments[{n}]").random() for n in range(4000)]

    assert stats.kstest(first, "uniform").pvalue > 1e-3
    assert stats.spearmanr(first[1:], first[:-1]).pvalue > 1e-3
