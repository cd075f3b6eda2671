"""The link master alone, with controllers that do next to nothing."""

from random import Random
from types import MappingProxyType

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocols.rorze.link import HALF_COMMAND_ENDS, POISON, LinkReader, StatusChanged
from protocols.rorze.row import MAX_COMMAND_LENGTH
from simulator.faults import Direction, Fault, Faults, Switch
from simulator.rorze.rc400 import LinkSettings, Rc400
from simulator.truth import TruthLog
from tests.simulator.rorze.fake_axis import FLASH_TIME_S, FakeAxis

FakeLine = Rc400[FakeAxis]


def build(settings: LinkSettings | None = None, seed: int = 0) -> FakeLine:
    axes = {body: FakeAxis(body) for body in (0x3F, 0x00, 0x01)}
    return Rc400(axes, TruthLog(), Faults(Random(seed)), settings)


def ask(line: FakeLine, command: str, now: float = 0.0) -> str:
    line.receive(command.encode() + b"\r", now)
    return heard(line, now)


def heard(line: FakeLine, now: float) -> str:
    return line.take_output(now).decode()


def test_a_body_is_asked_and_answers() -> None:
    line = build()
    assert ask(line, "&3F6PS-500") == ">&3F6PS-500\r"
    assert line.axes[0x3F].done == [(0.0, "6PS-500")]


def test_tabs_and_blanks_in_a_command_are_nothing() -> None:
    line = build()
    assert ask(line, " & 3F\tSED  S 1") == ">&3FSEDS1\r"


@pytest.mark.parametrize("introducer", ["$", "#"])
def test_the_old_form_with_one_digit_is_answered_in_kind(introducer: str) -> None:
    assert ask(build(), f"{introducer}16PD") == f">{introducer}16PD\r"


def test_a_refusal_carries_its_code_unless_that_is_switched_off() -> None:
    assert ask(build(), "&3FXXX") == ">&3FXXX@49\r"
    assert ask(build(LinkSettings(error_codes=False)), "&3FXXX") == ">&3FXXX@\r"


def test_sixty_characters_are_done_and_one_more_is_error_23() -> None:
    line = build()
    longest = "3FUWS" + "A" * (MAX_COMMAND_LENGTH - 5)
    assert ask(line, f"&{longest}") == f">&3FUWS{'A' * 55}\r"
    assert ask(line, f"&{longest}A") == ">&3FUWS@23\r"
    assert len(line.axes[0x3F].done) == 1


def test_a_half_command_dies_of_poison() -> None:
    line = build()
    line.receive(b"&3F1+M50" + POISON, 0.0)
    assert heard(line, 0.0) == ">&3F1+M@23\r"
    assert line.axes[0x3F].done == []


@pytest.mark.parametrize("cut", range(len("&3F1+M50") + 1))
def test_a_half_command_dies_of_other_line_ends_where_long_ones_are_executed(cut: int) -> None:
    line = build(LinkSettings(overlong="executed"))
    line.receive(b"&3F1+M50"[:cut] + HALF_COMMAND_ENDS["line_ends"], 0.0)
    assert heard(line, 0.0) == ""
    assert line.axes[0x3F].done == []
    assert ask(line, "&3F6PD") == ">&3F6PD\r", "what follows is heard"


def test_poison_alone_and_stray_line_ends_are_not_answered() -> None:
    line = build()
    for rest in (POISON, b"\r\r\n\n\r", b"&3F\r&3F6\r"):
        line.receive(rest, 0.0)
        assert heard(line, 0.0) == ""
    assert ask(line, "&3F6PD") == ">&3F6PD\r"


@pytest.mark.parametrize("end", [b"\r\r", b"\r\n", b"\r\r\n"])
def test_another_line_end_with_the_cr_makes_a_command_invalid(end: bytes) -> None:
    """The table of 17.1."""
    line = build()
    line.receive(b"&3F1+M5" + end + b"&3F6PS7" + end + b"&3F6P", 0.0)
    line.receive(b"D" + end, 1.0)
    assert (heard(line, 1.0), line.axes[0x3F].done) == ("", [])
    assert ask(line, "&3F6PD", 2.0) == ">&3F6PD\r"


@pytest.mark.parametrize("end", [b"\r\r", b"\r\n", b"\r\r\n"])
def test_other_line_ends_can_be_ignored(end: bytes) -> None:
    line = build(LinkSettings(excess_line_ends="ignored"))
    line.receive(b"&3F6PS7" + end + b"&3F6PD" + end, 0.0)
    assert heard(line, 0.0) == ">&3F6PS7\r>&3F6PD\r"


def test_nobody_answers_for_a_body_that_is_not_there() -> None:
    assert ask(build(), "&056PD") == ""
    assert ask(build(), "&7A6PD") == ""
    assert ask(build(LinkSettings(absent_bodies="error")), "&056PD") == ">&056PD@4C\r"


def test_a_group_answers_member_by_member() -> None:
    line = build()
    assert ask(line, "&80CED12,1") == ""  # not defined yet
    assert ask(line, "&7FXVS80,01,00") == ">&7FXVS\r"
    assert ask(line, "&80CED12,1") == ">&80CED[01:12,1][00:12,1]\r"


def test_a_member_that_is_not_there_is_left_out_or_refuses_as_the_setting_says() -> None:
    for line, told in (
        (build(), ">&80CED[3F:12,1]\r"),
        (build(LinkSettings(absent_bodies="error")), ">&80CED@[3F:12,1][05:@4C]\r"),
    ):
        ask(line, "&7FXVS80,3F,05")
        assert ask(line, "&80CED12,1") == told


def test_one_member_that_refuses_marks_the_whole_reply() -> None:
    line = build()
    line.axes[0x01].refusal = "@4A"
    ask(line, "&7FXVS80,00,01")
    assert ask(line, "&80CED13,1") == ">&80CED@[00:13,1][01:@4A]\r"


def test_a_member_without_power_is_missing_from_the_reply() -> None:
    line = build()
    ask(line, "&7FXVS80,00,01,05")
    line.switch_body(0x00, False, 1.0)
    assert ask(line, "&806PD", 1.0) == ">&806PD[01:]\r"
    line.switch_body(0x01, False, 2.0)
    assert ask(line, "&806PD", 2.0) == ""


@pytest.mark.parametrize("command", ["XVS7F,00", "XVS80", "XVS80,78", "XVS80,00,00", "XRSM2", "XRS", "XIDA"])
def test_link_commands_with_wrong_parameters_are_4a(command: str) -> None:
    assert ask(build(), f"&7F{command}") == f">&7F{command[:3]}@4A\r"


def test_other_commands_to_the_link_master_are_unknown() -> None:
    assert ask(build(), "&7F6PD") == ">&7F6PD@49\r"


def test_identification_lists_the_bodies_with_power() -> None:
    line = build()
    line.switch_body(0x00, False, 0.0)
    assert ask(line, "&7FXID") == ">&7FXID01,3F\r"


def test_the_end_of_a_move_is_told_only_on_request() -> None:
    line = build()
    ask(line, "&3F1+M1")
    assert heard(line, 5.0) == ""
    ask(line, "&7FXRSM1", 5.0)
    ask(line, "&3F1+M1", 5.0)
    assert line.wake_at() == 6.0
    assert heard(line, 5.999) == ""
    assert heard(line, 6.0) == ">&7D1+M[3F:00]\r"
    ask(line, "&7FXRSM0", 6.0)
    ask(line, "&3F1+M1", 6.0)
    assert heard(line, 9.0) == ""


def test_moves_that_end_together_share_a_frame_by_command() -> None:
    line = build()
    ask(line, "&7FXRSM1")
    ask(line, "&7FXVS80,00,01")
    ask(line, "&801+M2")
    ask(line, "&3F2+M2")
    assert heard(line, 2.0) == ">&7D1+M[00:00][01:00]\r>&7D2+M[3F:00]\r"


def test_moves_that_end_apart_do_not() -> None:
    line = build()
    ask(line, "&7FXRSM1")
    ask(line, "&001+M2")
    ask(line, "&011+M1")
    assert heard(line, 9.0) == ">&7D1+M[01:00]\r>&7D1+M[00:00]\r"


def test_a_reply_goes_out_before_the_end_of_its_own_move() -> None:
    line = build(LinkSettings(reply_delay_s=0.5))
    ask(line, "&7FXRSM1", 0.0)
    line.receive(b"&3F1+M0\r", 1.0)
    assert heard(line, 1.5) == ">&7FXRS\r>&3F1+M\r>&7D1+M[3F:00]\r"


def test_events_reach_the_host_only_after_identification() -> None:
    line = build()
    change = StatusChanged(0x3F, MappingProxyType({"M": 1, "I": 0x200, "P": -50}))
    line.axes[0x3F].say(change, 0.0)
    line.look_after(0x3F)
    assert heard(line, 0.0) == ""
    ask(line, "&7FXID")
    line.axes[0x3F].say(change, 1.0)
    line.look_after(0x3F)
    assert heard(line, 1.0) == ">&7EXED[3F:M:H01,I:H0200,P:-000000050]\r"
    (found,) = LinkReader().feed(b">&7EXED[3F:M:H01,I:H0200,P:-000000050]\r")
    assert found == change


def test_a_user_program_speaks_only_after_identification() -> None:
    line = build()
    line.send_program_message(0x3F, "HELLO", 0.0)
    assert heard(line, 0.0) == ""
    ask(line, "&7FXID")
    line.send_program_message(0x3F, "HELLO", 0.0)
    assert heard(line, 0.0) == ">&7CUSD[3F:HELLO]\r"


def test_a_text_waits_for_identification_and_is_collected_once() -> None:
    line = build()
    line.axes[0x3F].text = 0.0, "HELLO"
    line.look_after(0x3F)
    assert heard(line, 5.0) == ""
    assert ask(line, "&7FXID", 6.0).endswith("\r>&7CUSD[3F:HELLO]\r")
    line.look_after(0x3F)
    assert heard(line, 7.0) == ""


def test_a_text_is_collected_after_the_delay_of_messages() -> None:
    line = build(LinkSettings(reply_delay_s=0.5))
    ask(line, "&7FXID", 0.0)
    assert heard(line, 1.0) != ""
    line.axes[0x3F].text = 1.0, "OLD"
    line.look_after(0x3F)
    line.axes[0x3F].text = 1.2, "NEW"
    line.look_after(0x3F)
    assert heard(line, 1.4) == ""
    assert heard(line, 9.0) == ">&7CUSD[3F:NEW]\r"


def test_a_long_command_delays_only_its_own_reply() -> None:
    line = build()
    assert ask(line, "&3FFIS", 0.0) == ""
    assert ask(line, "&006PD", 0.2) == ">&006PD\r"
    assert line.wake_at() == FLASH_TIME_S
    assert heard(line, FLASH_TIME_S) == ">&3FFIS\r"


def test_a_link_master_that_takes_one_command_at_a_time_drops_the_second() -> None:
    line = build(LinkSettings(interjection="drop"))
    ask(line, "&3FFIS", 0.0)
    assert ask(line, "&006PD", 0.2) == ""
    assert line.axes[0x00].done == []
    assert heard(line, FLASH_TIME_S) == ">&3FFIS\r"
    assert ask(line, "&006PD", 2.0) == ">&006PD\r"


def test_a_power_cycle_of_the_link_master_loses_its_settings_and_no_move() -> None:
    line = build()
    for command in ("&7FXID", "&7FXRSM1", "&7FXVS80,00,01"):
        ask(line, command)
    ask(line, "&3F1+M5")
    line.receive(b"&3FFIS\r&3F6", 1.0)
    line.power_off(1.0)
    assert ask(line, "&3F6PD", 1.5) == ""
    line.power_on(2.0)
    assert ask(line, "PD", 2.0) == ""  # the half command before the cut is gone
    assert heard(line, 9.0) == ""  # nor does the reply of FIS come, or the end of the move
    assert line.axes[0x3F].wake_at() is None
    assert ask(line, "&806PD", 9.0) == ""
    assert ask(line, "&3F6PD", 9.0) == ">&3F6PD\r"


def test_power_that_is_off_cannot_go_off_again() -> None:
    line = build()
    line.power_off(1.0)
    line.power_off(2.0)
    line.power_on(3.0)
    line.power_on(4.0)
    assert [(fact.at, fact.facts["on"]) for fact in line.truth.of("power")] == [(1.0, False), (3.0, True)]


def test_a_brown_out_of_a_body_ends_at_its_time_unless_it_is_switched_before() -> None:
    line = build()
    line.brown_out(0x3F, 0.05, 1.0)
    assert line.wake_at() == 1.05
    assert ask(line, "&3F6PD", 1.04) == ""
    assert ask(line, "&3F6PD", 2.0) == ">&3F6PD\r"
    line.brown_out(0x3F, 0.05, 3.0)
    line.switch_body(0x3F, on=False, now=3.01)
    assert ask(line, "&3F6PD", 4.0) == ""
    assert [(fact.at, fact.facts["on"]) for fact in line.truth.of("power")] == [
        (1.0, False),
        (1.05, True),
        (3.0, False),
    ]


def test_a_line_end_may_be_cr_lf() -> None:
    line = build(LinkSettings(line_end="\r\n"))
    assert ask(line, "&3F6PD") == ">&3F6PD\r\n"


def test_time_that_goes_back_is_taken_as_now() -> None:
    line = build()
    ask(line, "&3F6PD", 5.0)
    ask(line, "&3F6PD", 4.0)
    assert line.axes[0x3F].done == [(5.0, "6PD"), (5.0, "6PD")]


# Faults on the way


def test_truth_ties_every_reply_to_its_request() -> None:
    line = build()
    line.receive(b"\r&3F6PD\r&006", 0.0)
    line.receive(b"PD\r&056PD\r", 1.0)
    assert [(fact.request, fact.facts["frame"]) for fact in line.truth.of("request")] == [
        (1, ""),
        (2, "&3F6PD"),
        (3, "&006PD"),
        (4, "&056PD"),
    ]
    assert [(fact.request, fact.facts["frame"]) for fact in line.truth.of("reply")] == [
        (2, ">&3F6PD"),
        (3, ">&006PD"),
    ]


def test_a_lost_command_is_never_done_and_a_lost_reply_is() -> None:
    line = build()
    line.faults.set(Switch(Fault.LOST, Direction.REQUESTS, next_frames=1))
    assert ask(line, "&3F1+M1") == ""
    assert line.axes[0x3F].done == []
    line.faults.set(Switch(Fault.LOST, Direction.REPLIES, next_frames=1))
    assert ask(line, "&3F1+M1") == ""
    assert len(line.axes[0x3F].done) == 1
    assert line.truth.of("reply")[0].facts["faults"] == {Fault.LOST: 0.1}


def test_a_late_reply_is_overtaken_and_still_known_by_its_request() -> None:
    line = build()
    line.faults.set(Switch(Fault.LATE, Direction.REPLIES, next_frames=1, delay_s=0.3))
    assert ask(line, "&3F6PDA") == ""
    assert ask(line, "&3F6PDB", 0.1) == ">&3F6PDB\r"
    assert heard(line, 0.3) == ">&3F6PDA\r"
    assert [fact.request for fact in line.truth.of("reply")] == [1, 2]


def test_a_doubled_command_is_done_twice_in_the_name_of_one_request() -> None:
    line = build()
    line.faults.set(Switch(Fault.DOUBLED, Direction.REQUESTS, next_frames=1, delay_s=0.2))
    assert ask(line, "&3F6PD") == ">&3F6PD\r"
    assert heard(line, 0.2) == ">&3F6PD\r"
    assert [at for at, _ in line.axes[0x3F].done] == [0.0, 0.2]
    assert [fact.request for fact in line.truth.of("reply")] == [1, 1]


def test_a_split_reply_is_not_cut_into_by_the_next() -> None:
    line = build()
    line.faults.set(Switch(Fault.SPLIT, Direction.REPLIES, next_frames=1, delay_s=0.5))
    first = ask(line, "&3F6PDA")
    assert 0 < len(first) < len(">&3F6PDA\r")
    assert ask(line, "&3F6PDB", 0.1) == ""
    assert first + heard(line, 0.5) == ">&3F6PDA\r>&3F6PDB\r"


def test_a_split_command_is_done_when_its_second_piece_is_there() -> None:
    line = build()
    line.faults.set(Switch(Fault.SPLIT, Direction.REQUESTS, next_frames=1, delay_s=0.5))
    assert ask(line, "&3F6PD") == ""
    assert heard(line, 0.5) == ">&3F6PD\r"


def test_two_merged_commands_are_one_that_cannot_be_done() -> None:
    line = build()
    line.faults.set(Switch(Fault.MERGED, Direction.REQUESTS, next_frames=1))
    assert ask(line, "&3F6PD") == ""
    assert ask(line, "&006PD") == ">&3F6PD@4A\r"
    assert line.axes[0x00].done == []
    assert line.truth.of("reply")[0].request == 2


def test_a_silence_swallows_all_within_it_one_way() -> None:
    line = build()
    line.faults.set(Switch(Fault.SILENCE, Direction.REPLIES, next_frames=1, delay_s=2.0))
    assert [ask(line, "&3F6PD", now) for now in (0.0, 1.0, 1.9, 2.0)] == ["", "", "", ">&3F6PD\r"]
    assert len(line.axes[0x3F].done) == 4


def test_noise_before_a_reply_does_not_hide_it() -> None:
    for seed in range(50):
        line = build(seed=seed)
        line.faults.set(Switch(Fault.NOISE, Direction.REPLIES, next_frames=1))
        line.receive(b"&3F6PD\r", 0.0)
        output = line.take_output(0.0)
        assert output.endswith(b">&3F6PD\r")
        assert len(output) > len(b">&3F6PD\r")


commands = st.one_of(
    st.sampled_from(
        ["&3F6PD", "&001+M0.5", "&3FFIS", "&7FXID", "&7FXRSM1", "&7FXVS80,00,3F", "&80XXX", "&801+M1"]
    ),
    st.text(st.characters(min_codepoint=1, max_codepoint=255), max_size=80),
)
switches = st.builds(
    Switch,
    st.sampled_from(Fault),
    st.sampled_from(Direction),
    probability=st.floats(0, 1),
    delay_s=st.floats(0, 2),
    spread_s=st.floats(0, 1),
)


@given(st.lists(st.tuples(st.floats(0, 1), commands)), st.lists(switches, max_size=4), st.integers())
def test_whatever_comes_and_goes_wrong_time_runs_on_and_ends(
    story: list[tuple[float, str]], faults: list[Switch], seed: int
) -> None:
    line, now = build(seed=seed), 0.0
    for switch in faults:
        line.faults.set(switch)
    for pause, text in story:
        now += pause
        line.receive(text.encode("latin-1") + b"\r", now)
        line.take_output(now)
        wake_at = line.wake_at()
        assert wake_at is None or wake_at > now
    line.take_output(now + 1000.0)
    assert line.wake_at() is None
    done = [at for axis in line.axes.values() for at, _ in axis.done]
    assert all(0.0 <= at <= now + 1000.0 for at in done)


@given(st.lists(commands), st.lists(st.integers(1, 7), max_size=40))
def test_how_the_hosts_bytes_are_split_makes_no_difference(texts: list[str], cuts: list[int]) -> None:
    data = "".join(f"{text}\r" for text in texts).encode("latin-1")
    # Whether a CR comes with the one before it is the one difference a split may make.
    whole, pieces = (build(LinkSettings(excess_line_ends="ignored")) for _ in range(2))
    whole.receive(data, 0.0)
    place = 0
    for cut in cuts:
        pieces.receive(data[place : place + cut], 0.0)
        place += cut
    pieces.receive(data[place:], 0.0)
    assert pieces.take_output(5.0) == whole.take_output(5.0)
    assert [axis.done for axis in pieces.axes.values()] == [axis.done for axis in whole.axes.values()]
