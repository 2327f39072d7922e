"""What several frames say of a code: believed by a checksum or by agreement, never by luck."""

from __future__ import annotations

from dataclasses import replace

from flightd.core.types import CodeRead
from flightd.mission.scan.code_assignment import PlacedRead
from flightd.mission.scan.code_votes import CodeVotes


def placed(
    text: str, *, sure: bool, quality: float = 0.5, x_m: float = 1.0, probability: float = 0.99
) -> PlacedRead:
    read = CodeRead("ITF", text, ((0.0, 0.0),) * 4, sure, 1, quality)
    return PlacedRead(read, "A-1", "A-1", x_m, 1.2, 0.1, probability)


def test_two_frames_make_a_read_without_checksum_believed() -> None:
    votes = CodeVotes()
    assert votes.add(1, [placed("070429", sure=False)])
    assert not votes.add(1, [placed("070429", sure=False)])
    assert votes.any_read
    assert votes.believed() == ()
    assert [(code.read.text, looks) for code, looks in votes.seen() if not code.read.believed] == [
        ("070429", 1)
    ]
    assert votes.add(2, [placed("070429", sure=False), placed("07042", sure=False)])
    assert [(code.read.text, code.read.agreeing) for code in votes.believed()] == [("070429", 2)]
    assert [(code.read.text, looks) for code, looks in votes.seen() if not code.read.believed] == [
        ("07042", 1)
    ]


def test_a_checksum_is_believed_at_once_and_the_most_seen_comes_first() -> None:
    votes = CodeVotes()
    votes.add(1, [placed("A", sure=True), placed("B", sure=True)])
    votes.add(2, [placed("B", sure=True)])
    assert [code.read.text for code in votes.believed()] == ["B", "A"]


def test_the_best_read_is_kept_with_the_newest_place_and_the_highest_probability() -> None:
    votes = CodeVotes()
    votes.add(1, [placed("A", sure=True, quality=0.9, x_m=1.0, probability=0.999)])
    votes.add(2, [placed("A", sure=True, quality=0.4, x_m=1.1, probability=0.991)])
    (code,) = votes.believed()
    assert (code.read.quality, code.x_m, code.probability, code.read.agreeing) == (0.9, 1.1, 0.999, 2)


def test_what_may_be_a_part_of_a_longer_code_is_seen_and_never_believed() -> None:
    """Half of a damaged EAN-13 is the same UPC-E in every view."""
    votes, half = CodeVotes(), placed("109481000094", sure=False, quality=0.9)
    part = replace(half, read=replace(half.read, agreeing=3, whole=False))
    for frame in range(5):
        votes.add(frame, [part])
    assert votes.any_read
    assert votes.only_parts
    assert votes.believed() == ()
    assert votes.frames(part) == 0
    assert [(code.read.text, looks) for code, looks in votes.seen() if not code.read.believed] == [
        ("109481000094", 5)
    ]


def test_a_code_is_believed_by_the_frames_that_show_it_whole() -> None:
    votes, whole = CodeVotes(), placed("070429", sure=False, quality=0.4)
    part = replace(whole, read=replace(whole.read, agreeing=2, quality=0.9, whole=False))
    votes.add(1, [part])
    votes.add(2, [whole])
    assert not votes.only_parts
    assert votes.believed() == (), "one frame shows it whole"
    votes.add(3, [whole])
    assert [(code.read.text, code.read.agreeing) for code in votes.believed()] == [("070429", 2)]
