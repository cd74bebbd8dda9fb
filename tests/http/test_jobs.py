"""Jobs: pictures made in the background are those made at once, watched, called off, forgotten."""

import json
import time
from typing import Any

import httpx
import pytest

from .conftest import PATH, SCENE, Start

pytestmark = pytest.mark.needs("gl")

LATER = {"Prefer": "respond-async"}
# Some seconds of eyes, each of which takes a few milliseconds: what is called off ends soon.
LONG = {"picture": "look", "scene": SCENE, "sweep": "-10:10:400", "size": "480x270"}


def finished(client: httpx.Client, job: str) -> dict[str, Any]:
    """The job, once it has ended."""
    while (told := client.get(job)).json()["finished"] is None:
        assert told.headers["retry-after"]
        time.sleep(0.05)
    answer: dict[str, Any] = told.json()
    return answer


def test_a_picture_made_later_is_the_one_made_at_once(client: httpx.Client, small: str) -> None:
    query = {"display": small, "yaw": 12}
    later = client.get(f"{PATH}/eia", params=query, headers=LATER)
    assert (later.status_code, later.headers["preference-applied"]) == (202, "respond-async")
    job = later.headers["location"]
    assert finished(client, job)["state"] == "done"
    made = client.get(f"{job}/result")
    at_once = client.get(f"{PATH}/eia", params=query)
    assert made.content == at_once.content
    for name in ("etag", "content-type", "lfd-size"):
        assert made.headers[name] == at_once.headers[name]
    known = client.get(f"{job}/result", headers={"If-None-Match": made.headers["etag"]})
    assert (known.status_code, known.content) == (304, b"")
    # What is there already is answered at once.
    assert client.get(f"{PATH}/eia", params=query, headers=LATER).status_code == 200


def test_frames_of_a_moving_camera_come_one_by_one(client: httpx.Client, small: str) -> None:
    frames = [{"picture": "eia", "scene": SCENE, "display": small, "yaw": yaw} for yaw in range(6)]
    accepted = client.post("/v1/jobs", json={"pictures": frames, "accept": "image/webp"})
    assert accepted.status_code == 202
    job = accepted.headers["location"]
    events = []
    with client.stream("GET", f"{job}/events") as stream:
        assert stream.headers["content-type"].startswith("text/event-stream")
        for line in stream.iter_lines():
            name, _, value = line.partition(": ")
            if name == "data":
                events.append(json.loads(value))
    assert events[-1]["state"] == "done"
    parts = [event["part"] for event in events]
    assert parts == sorted(parts)
    assert parts[-1] == 1
    for frame, picture in zip(frames, events[-1]["pictures"], strict=True):
        made = client.get(picture["url"])
        again = client.post("/v1/render", json=frame, headers={"Accept": "image/webp"})
        assert made.content == again.content
        assert (made.headers["content-type"], len(made.content)) == ("image/webp", picture["bytes"])
    assert client.get(f"{job}/result").status_code == 409  # which of them?
    assert client.get(f"{job}/results/6").status_code == 404
    assert client.delete(job).status_code == 204
    assert client.get(job).status_code == 404


def test_a_key_makes_one_job(client: httpx.Client, small: str) -> None:
    body = {"pictures": [{"picture": "eia", "scene": SCENE, "display": small, "seed": 1}]}
    key = {"Idempotency-Key": "a1"}
    first, again = (client.post("/v1/jobs", json=body, headers=key) for _ in range(2))
    assert first.headers["location"] == again.headers["location"]
    other = client.post("/v1/jobs", json=body).headers["location"]
    assert other != first.headers["location"]
    body["pictures"][0]["seed"] = 2
    wrong = client.post("/v1/jobs", json=body, headers=key)
    assert (wrong.status_code, wrong.json()["field"]) == (422, "Idempotency-Key")


def test_a_job_that_fails_says_why(client: httpx.Client, small: str) -> None:
    bad = {"picture": "eia", "scene": SCENE, "display": small, "camera": "none of its own"}
    job = client.post("/v1/jobs", json={"pictures": [bad]}).headers["location"]
    told = finished(client, job)
    assert (told["state"], told["problem"]["status"]) == ("failed", 422)
    result = client.get(f"{job}/result")
    assert (result.status_code, result.json()["field"]) == (422, "camera")
    late = client.post("/v1/jobs", json={"pictures": [bad, bad | {"display": "none"}]})
    assert (late.status_code, late.json()["field"]) == (404, "pictures.1")


@pytest.mark.parametrize("processes", [1, 2])
def test_a_job_gives_way(start: Start, profile: dict[str, Any], processes: int) -> None:
    """A picture that somebody waits for is made while a long one is, on one process or two."""
    with start("--processes", str(processes)) as server, server.client() as client:
        client.put("/v1/displays/small", json=profile)
        plain = {"display": "small"}
        job = client.post("/v1/render", json=LONG | {"display": profile}, headers=LATER).headers[
            "location"
        ]
        while client.get(job).json()["part"] == 0:
            time.sleep(0.01)
        for yaw in range(3):
            assert client.get(f"{PATH}/eia", params=plain | {"yaw": yaw + 1}).status_code == 200
            assert client.get(job).json()["state"] == "running"
        assert client.delete(job).status_code == 204
        while "lfd_running 0.0" not in client.get("/metrics").text:
            time.sleep(0.02)


def test_room_is_bounded_and_given_back(start: Start, profile: dict[str, Any]) -> None:
    settings = {"job_results_mb": 1, "max_jobs": 3, "job_keep_s": 1.5}
    frame = {"picture": "eia", "scene": SCENE, "display": profile}
    small, raw = {"pictures": [frame]}, "application/octet-stream"  # of 62 kB
    many = {"pictures": [frame | {"yaw": yaw} for yaw in range(20)], "accept": raw}
    with start("--processes", "2", **settings) as server, server.client() as client:
        jobs = [client.post("/v1/jobs", json=small).headers["location"] for _ in range(3)]
        for job in jobs:
            assert finished(client, job)["state"] == "done"
        large = client.post("/v1/jobs", json=many).headers["location"]
        assert client.get(jobs[0]).status_code == 404  # the oldest went for it
        told = finished(client, large)
        assert (told["state"], told["problem"]["status"]) == ("failed", 507)
        assert client.get(jobs[2]).status_code == 404  # as did the others, for its pictures
        long = [
            client.post("/v1/jobs", json={"pictures": [LONG | {"display": profile}]})
            for _ in range(4)
        ]
        assert [answer.status_code for answer in long] == [202, 202, 202, 429]
        assert int(long[3].headers["retry-after"]) > 0
        for answer in long[:3]:
            client.delete(answer.headers["location"])
        short = client.post("/v1/jobs", json=small).headers["location"]
        finished(client, short)
        expired = time.monotonic() + 10
        while client.get(short).status_code != 404:
            assert time.monotonic() < expired
            time.sleep(0.1)
