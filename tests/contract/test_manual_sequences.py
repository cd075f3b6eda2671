"""The worked sequences of RC-420 manual 12 and 13, as dialogues in bytes."""

from dataclasses import replace
from pathlib import Path

import pytest

from simulator.rorze.world import CW_LIMIT, EMS, ORIGIN, STALL, Slits, Span
from tests.contract.hosts import ClockHost, Host, at_socket, at_terminal

pytestmark = pytest.mark.anyio

MOVE_ENDS_ON = """
    &7FXRSM1
    >&7FXRS
"""
PATTERN_17 = """
    &00OLSS[12],5000
    >&00OLS
    &00OHSS[12],50000
    >&00OHS
    &00OSSS[12],70000
    >&00OSS
    &00OASS[12],30
    >&00OAS
    &00OBSS[12],30
    >&00OBS
    &00OLSS[00],50
    >&00OLS
    &00OHSS[00],50000
    >&00OHS
    &00OSSS[00],95000
    >&00OSS
    &00OASS[00],50
    >&00OAS
    &00OBSS[00],20
    >&00OBS
    &00SPSA[17],A:S[12],D:S[00]
    >&00SPS
"""
ACCELERATION, DECELERATION = 25_236, 17_778
ACCELERATION_S, DECELERATION_S = 45_000 / (70_000 * 0.7), 49_950 / (95_000 * 0.65)


async def number(host: Host, query: str) -> int:
    """The decimal value that a query to a body is answered with."""
    return int((await host.ask(query)).removeprefix(f">{query[:6]}"))


async def pulses_in(host: ClockHost, seconds: float, body: str = "3F") -> int:
    """Pulses given in the next stretch of time."""
    before = await number(host, f"&{body}6PD")
    host.wait(seconds)
    return await number(host, f"&{body}6PD") - before


# 12 The form of commands and replies


async def test_a_reply_with_several_values() -> None:
    """The printed speed change; a pattern whose ramp to 10,000 pps takes 2,000 pulses."""
    await ClockHost().play("""
        &3FOLSS[1],50
        >&3FOLS
        &3FOHSS[1],20000
        >&3FOHS
        &3FOSSS[1],150324
        >&3FOSS
        &3FOASS[1],50
        >&3FOAS
        &3FOBSS[1],50
        >&3FOBS
        &3FSPSA[1],A:S[1],D:S[1]
        >&3FSPS
        &3FSESA[1],3,F5000,S10000
        >&3FSES
        &3F SED A[1] , 3
        >&3FSEDF5000,T7000,S10000
    """)


async def test_an_error_with_its_code_and_without() -> None:
    """The link master can be set to leave the code out."""
    host = ClockHost()
    assert await host.ask("&3FSEDA[99],3") == ">&3FSED@4A"
    host.line.settings = replace(host.line.settings, error_codes=False)
    assert await host.ask("&3FSEDA[99],3") == ">&3FSED@"


async def test_blanks_are_ignored_and_sixty_characters_are_the_most() -> None:
    """The sixty count from the body number on: one more, and what was wrong with them no longer matters."""
    await ClockHost().play(f"""
        & 3F\t6PS 50 00
        >&3F6PS
        &3F{" " * 60}6PD
        >&3F6PD+000005000
        &3F6PS{"X" * 55}
        >&3F6PS@4A
        &3F6PS{"X" * 56}
        >&3F6PS@23
    """)


async def test_one_digit_of_body_number_after_the_older_introducers() -> None:
    await ClockHost(0x03).play("""
        $36PD
        >$36PD+000000000
        #36PS5
        >#36PS
        &036PD
        >&036PD+000000005
    """)


GROUP = """
    &7FXVS80,00,01
    >&7FXVS
    &00CESE,12,1
    >&00CES
    &01CESE,13,1
    >&01CES
"""


async def test_a_virtual_body_answers_for_each_of_its_members() -> None:
    await ClockHost(0x00, 0x01).play(
        GROUP
        + """
        &80CEDE
        >&80CED[00:12,1][01:13,1]
        &80CEDX
        >&80CED@[00:@4A][01:@4A]
    """
    )


async def test_a_virtual_body_tells_which_member_has_refused() -> None:
    """In the printed form; its 4A could come from one member only if their parameters differed."""
    await ClockHost(0x00, 0x01).play(
        GROUP
        + """
        &001+MZ
        >&001+M
        &80EMS
        >&80EMS@[00:@50][01:]
        &80SPD
        >&80SPD@[00:@50][01:A:S[30],D:S[30]]
    """
    )


async def test_members_that_end_together_share_a_frame() -> None:
    host = ClockHost(0x00, 0x01)
    await host.play(
        MOVE_ENDS_ON
        + GROUP
        + """
        &801+M500
        >&801+M[00:][01:]
        >&7D1+M[00:00][01:00]
    """
    )
    host.change(body=0x01, cw_limit=Span(700, 800))
    await host.play("""
        &801+M500
        >&801+M[00:][01:]
        >&7D1+M[01:02]
        >&7D1+M[00:00]
    """)


# 13.1, 13.2 Positioning


async def test_operating_modes() -> None:
    """13.1.2, 13.1.3."""
    await ClockHost().play("""
        &3FEAS1
        >&3FEAS
        &3FEAD
        >&3FEAD1
        &3FEAS0
        >&3FEAS
        &3FEAD
        >&3FEAD0
    """)


FAST_MOVE = """
    &7FXRSM1
    >&7FXRS
    &3FOLS30000
    >&3FOLS
    &3FOHS1000000
    >&3FOHS
    &3FOSS10000000
    >&3FOSS
    &3F1+M50000
    >&3F1+M
    >&7D1+M[3F:00]
    &3F6PD
    >&3F6PD+000050000
"""


async def test_a_move_is_answered_at_once_and_again_at_its_end(tmp_path: Path) -> None:
    """13.2.2: the normal and the special response, at a terminal, at a socket, and in given time."""
    async with at_terminal(tmp_path / "line") as at_a_terminal, at_socket() as at_a_socket:
        for host in (at_a_terminal, at_a_socket, ClockHost()):
            await host.play(FAST_MOVE)


async def test_without_xrs_no_end_of_move_is_told() -> None:
    host = ClockHost()
    await host.play("""
        &3F1+M50000
        >&3F1+M
    """)
    host.wait(60)
    assert host.unheard() == ""
    assert await host.ask("&3F6PD") == ">&3F6PD+000050000"


async def test_the_six_moves_by_way_and_speed() -> None:
    """13.2.2: relative and absolute, with ramps and without."""
    await ClockHost().play(
        MOVE_ENDS_ON
        + """
        &3F1+M300
        >&3F1+M
        >&7D1+M[3F:00]
        &3F1-M1000
        >&3F1-M
        >&7D1-M[3F:00]
        &3F1AM500
        >&3F1AM
        >&7D1AM[3F:00]
        &3F2+M20
        >&3F2+M
        >&7D2+M[3F:00]
        &3F2-M40
        >&3F2-M
        >&7D2-M[3F:00]
        &3F6PD
        >&3F6PD+000000480
        &3F2AM-5
        >&3F2AM
        >&7D2AM[3F:00]
        &3F6PD
        >&3F6PD-000000005
    """
    )


async def test_positions_stay_between_minus_and_plus_a_thousand_million() -> None:
    """13.2.2."""
    await ClockHost().play(
        """
        &3F6PS1000000000
        >&3F6PS@4A
        &3F6PS999999999
        >&3F6PS
        &3F1+M1
        >&3F1+M@5D
        &3F6PD
        >&3F6PD+000999999999
    """.replace("+000999999999", "+999999999")
    )


# 13.3 Speed


async def test_the_pulses_of_pattern_17() -> None:
    """13.3.4, 13.3.5: 25,236 to accelerate, 17,778 to decelerate."""
    await ClockHost(0x00).play(
        PATTERN_17
        + """
        &00SPDA[17]
        >&00SPDA:S[12],D:S[0]
        &00SSDA[17]
        >&00SSDA:25236,D:17778
    """
    )


async def test_a_move_that_reaches_its_highest_speed() -> None:
    """13.3.5: 50,000 pulses; the deceleration starts at pulse 32,222."""
    host = ClockHost(0x00)
    await host.play(MOVE_ENDS_ON + PATTERN_17)
    await host.play("""
        &001+MA[17],50000
        >&001+M
    """)
    host.wait(ACCELERATION_S)
    assert await number(host, "&006PD") == pytest.approx(ACCELERATION, abs=50)
    at_speed_s = (50_000 - DECELERATION - ACCELERATION) / 50_000
    assert await pulses_in(host, at_speed_s, "00") == pytest.approx(50_000 * at_speed_s, abs=25)
    assert await number(host, "&006PD") == pytest.approx(32_222, abs=50)
    await host.play("""
        >&7D1+M[00:00]
        &006PD
        >&006PD+000050000
    """)
    assert host.now == pytest.approx(ACCELERATION_S + at_speed_s + DECELERATION_S, abs=0.005)


async def test_a_move_too_short_for_its_highest_speed_keeps_its_shape() -> None:
    """13.3.5: 5,000 pulses with the same pattern; the highest speed is lowered instead."""
    host = ClockHost(0x00)
    await host.play(PATTERN_17)
    await host.play("""
        &001+MA[17],5000
        >&001+M
    """)
    speeds = []
    while await number(host, "&009CD0"):
        speeds.append(await pulses_in(host, 0.01, "00") / 0.01)
    assert 5_000 < max(speeds) < 25_000
    assert speeds[0] == pytest.approx(5_000, rel=0.1)
    assert speeds[-2] < 1_000
    peak = speeds.index(max(speeds))
    assert speeds[:peak] == sorted(speeds[:peak]), "faster and faster"
    assert speeds[peak + 3 : -1] == sorted(speeds[peak + 3 : -1], reverse=True), "then slower and slower"
    assert await number(host, "&006PD") == 5_000


async def test_a_deceleration_from_less_than_the_speed_stops_abruptly() -> None:
    """13.3.5, example 1: the deceleration's OH is lower, so it starts too late."""
    host = ClockHost(0x00)
    await host.play(MOVE_ENDS_ON + PATTERN_17)
    await host.play("""
        &00OHSS[00],40000
        >&00OHS
        &00SSDA[17]
        >&00SSDA:25236,D:11383
        &001+MA[17],50000
        >&001+M
    """)
    host.wait(ACCELERATION_S + (50_000 - ACCELERATION - 11_383) / 50_000)
    assert await number(host, "&006PD") == pytest.approx(50_000 - 11_383, abs=50)
    speed = 0.0
    while await number(host, "&006PD") < 49_500:
        speed = await pulses_in(host, 0.005, "00") / 0.005
    assert speed > 10_000, "far above OL shortly before the last pulse"
    await host.play("""
        >&7D1+M[00:00]
        &006PD
        >&006PD+000050000
    """)


async def test_a_deceleration_from_more_than_the_speed_creeps_to_the_end() -> None:
    """13.3.5, example 2: the deceleration's OH is higher, so it ends early and OL leads to the end."""
    host = ClockHost(0x00)
    await host.play(MOVE_ENDS_ON + PATTERN_17)
    await host.play("""
        &00OHSS[00],60000
        >&00OHS
        &00SSDA[17]
        >&00SSDA:25236,D:25594
        &001+MA[17],60000
        >&001+M
    """)
    host.wait(ACCELERATION_S + (60_000 - ACCELERATION - 25_594) / 50_000 + DECELERATION_S)
    assert await number(host, "&006PD") == pytest.approx(60_000 - (25_594 - DECELERATION), abs=200)
    host.wait(0.1)
    assert await pulses_in(host, 2.0, "00") == pytest.approx(100, abs=1)
    await host.play("""
        >&7D1+M[00:00]
        &006PD
        >&006PD+000060000
    """)


async def test_a_command_changes_the_speed_of_a_move() -> None:
    """13.3.6: from 20,000 to 50,000 pps on the way."""
    host = ClockHost(0x00)
    await host.play("""
        &005CS50000
        >&005CS@56
        &00OHS20000
        >&00OHS
        &001+MZ
        >&001+M
    """)
    host.wait(2)
    assert await pulses_in(host, 0.1, "00") == pytest.approx(2_000, abs=1)
    await host.play("""
        &005CS50000
        >&005CS
    """)
    host.wait(2)
    assert await pulses_in(host, 0.1, "00") == pytest.approx(5_000, abs=1)


async def test_speed_changes_set_before_the_move() -> None:
    """13.3.7: at 10,000 pps from pulse 78,000 on, past a sensor, and faster again from pulse 80,000 on."""
    host = ClockHost(0x00)
    await host.play(MOVE_ENDS_ON + PATTERN_17)
    await host.play("""
        &00SESA[17],0,T78000,S10000
        >&00SES
        &00SESA[17],1,F80000,S50000
        >&00SES
        &001+MA[17],150000
        >&001+M
    """)
    while await number(host, "&006PD") < 60_000:
        host.wait(0.001)
    assert await pulses_in(host, 0.002, "00") == pytest.approx(100, abs=2)
    while await number(host, "&006PD") < 78_000:
        host.wait(0.001)
    assert await pulses_in(host, 0.18, "00") == pytest.approx(1_800, abs=2)
    while await number(host, "&006PD") < 110_000:
        host.wait(0.001)
    assert await pulses_in(host, 0.1, "00") == pytest.approx(5_000, abs=2)
    await host.play("""
        >&7D1+M[00:00]
        &006PD
        >&006PD+000150000
    """)


async def test_speed_changes_that_cannot_be_carried_out_refuse_the_move() -> None:
    """13.3.7: the speed must be that of the deceleration again before it starts."""
    host = ClockHost(0x00)
    await host.play(PATTERN_17)
    await host.play("""
        &00SESA[17],0,T78000,S10000
        >&00SES
        &001+MA[17],150000
        >&001+M@62
        &00SESA[17],1,F80000,S50000
        >&00SES
        &001+MA[17],110000
        >&001+M@65
        &001+MA[17],150000
        >&001+M
    """)


# 13.4 The position table


async def test_distances_from_the_position_table() -> None:
    """13.4.2: the same move, its distance given directly and by position number."""
    host = ClockHost(0x00)
    await host.play(MOVE_ENDS_ON + PATTERN_17.replace("A[17]", "A[3]"))
    await host.play("""
        &001+MA[3],30000
        >&001+M
        >&7D1+M[00:00]
        &003PSP[12],30000
        >&003PS
        &001+MA[3],P[12]
        >&001+M
        >&7D1+M[00:00]
        &006PD
        >&006PD+000060000
    """)


TABLE = {0: 50_000, 1: 87_500, 2: 5_000, 3: 37_512, 4: 5_000, 5: 50_000, 2047: 0}


async def test_the_printed_position_table() -> None:
    """13.4.2: 30,000 pulses with pattern 2, and what stands at place 12 with pattern 1."""
    host = ClockHost(0x00)
    for pattern in (1, 2):
        await host.play(PATTERN_17.replace("A[17]", f"A[{pattern}]"))
    await host.command(*(f"3PSP[{number}],{pulses}" for number, pulses in TABLE.items()), body=0)
    for number, pulses in TABLE.items():
        assert await host.ask(f"&003PDP[{number}]") == f">&003PD+{pulses:09d}"
    await host.play(
        MOVE_ENDS_ON
        + """
        &001+MA[2],30000
        >&001+M
        >&7D1+M[00:00]
        &003PSP[12],500
        >&003PS
        &001+MA[1],P[12]
        >&001+M
        >&7D1+M[00:00]
        &006PD
        >&006PD+000030500
    """
    )


async def test_the_position_index_counts_up_to_its_end() -> None:
    """13.4.3: setting values from 2045 on; 2048 does not exist."""
    await ClockHost(0x00).play("""
        &003IS2045
        >&003IS
        &003PSP[+],100
        >&003PS
        &003PSP[+],20000
        >&003PS
        &003PSP[+],30000
        >&003PS
        &003PSP[+],40000
        >&003PS@5D
        &003NDP[2045]
        >&003NDP[2045],+000000100
        &003NDP[2046]
        >&003NDP[2046],+000020000
        &003NDP[2047]
        >&003NDP[2047],+000030000
        &003PDP[+]
        >&003PD@5D
        &003IS2047
        >&003IS
        &003PDP[-]
        >&003PD+000030000
        &003PDP[-]
        >&003PD+000020000
    """)


async def test_the_position_index_counts_down_to_its_end() -> None:
    """13.4.3: moving by 2, 1 and 0; -1 does not exist."""
    await ClockHost(0x00).play(
        MOVE_ENDS_ON
        + """
        &003PSP[0],1000
        >&003PS
        &003PSP[1],200
        >&003PS
        &003PSP[2],30
        >&003PS
        &003IS2
        >&003IS
        &001+MP[-]
        >&001+M
        >&7D1+M[00:00]
        &006PD
        >&006PD+000000030
        &003ID
        >&003ID0001
        &001+MP[-]
        >&001+M
        >&7D1+M[00:00]
        &006PD
        >&006PD+000000230
        &001+MP[-]
        >&001+M
        >&7D1+M[00:00]
        &006PD
        >&006PD+000001230
        &001+MP[-]
        >&001+M@5D
    """
    )


async def test_positions_in_flash_outlive_a_loss_of_power() -> None:
    """13.4.2: writing them takes about 1.5 s."""
    host = ClockHost()
    await host.command("3PSP[12],30000")
    asked_at = host.now
    await host.command("FPS")
    assert host.now - asked_at == pytest.approx(1.5)
    await host.command("3PSP[13],5")
    host.touch(lambda now: host.line.switch_body(0x3F, False, now))
    host.touch(lambda now: host.line.switch_body(0x3F, True, now))
    await host.play("""
        &3F3PDP[12]
        >&3F3PD+000030000
        &3F3PDP[13]
        >&3F3PD+000000000
    """)


# 13.5 Origin search

DOG = Span(1_000, 1_199)
ORIGIN_AT = 1_199 - 20


@pytest.mark.parametrize(
    ("place", "case"),
    [
        (3_000, "CW of the sensor"),
        (1_100, "on the sensor"),
        (500, "CCW of the sensor"),
        (5_050, "on the CW limit"),
        (-450, "on the CCW limit"),
        (6_000, "beyond the CW limit"),
    ],
)
@pytest.mark.parametrize("code", ["00M", "02M", "03M"])
async def test_origin_searches_end_at_the_offset_from_the_cw_edge(code: str, place: int, case: str) -> None:
    """13.5.1, 13.5.2: wherever they start but beyond the CCW limit."""
    host = ClockHost()
    host.change(origin=DOG, ccw_limit=Span(-500, -400), cw_limit=Span(5_000, 5_100), slipped=-place)
    await host.play(f"""
        &7FXRSM1
        >&7FXRS
        &3FOLS50
        >&3FOLS
        &3F0SS20
        >&3F0SS
        &3F0BS2
        >&3F0BS
        &3F{code}
        >&3F{code}
        >&7D{code}[3F:00]
        &3F6PD
        >&3F6PD+000000000
        &3F6ED
        >&3F6ED+000000000
        &3F0PD
        >&3F0PD{place - ORIGIN_AT:+010d}
        &3F9CD
        >&3F9CDH00
        &3FCLD1
        >&3FCLD1
        &3F1+M21
        >&3F1+M
        >&7D1+M[3F:00]
        &3FCLD1
        >&3FCLD0
    """)


async def test_a_search_that_finds_nothing_is_told_by_its_end() -> None:
    host = ClockHost()
    host.change(forced={ORIGIN: False}, ccw_limit=Span(-500, -400), cw_limit=Span(5_000, 5_100))
    await host.play("""
        &7FXRSM1
        >&7FXRS
        &3F00M
        >&3F00M
        >&7D00M[3F:02]
        &3F9CD
        >&3F9CDH02
        &3F9MD
        >&3F9MDH02
    """)


# 13.6 Stall detection


async def test_a_stall_is_noticed_and_stops_every_move_until_it_is_cleared() -> None:
    """13.6.2."""
    host = ClockHost()
    host.change(slits=Slits(-20, 100))
    await host.play(
        MOVE_ENDS_ON
        + """
        &3FQIS100
        >&3FQIS
        &3F0QM
        >&3F0QM
        >&7D0QM[3F:00]
        &3FQSS1
        >&3FQSS
        &3F1+M1000
        >&3F1+M
        >&7D1+M[3F:00]
    """
    )
    host.change(slipped=50)
    await host.play("""
        &3F1+M1000
        >&3F1+M
        >&7D1+M[3F:01]
        &3F9MD
        >&3F9MDH01
        &3F9CD
        >&3F9CDH40
        &3FQRD
        >&3FQRD1
        &3F1+M1000
        >&3F1+M@52
        &3FQRS
        >&3FQRS
        &3FQRD
        >&3FQRD0
        &3F1-M50
        >&3F1-M
    """)


async def test_a_search_and_a_centring_also_end_a_stall() -> None:
    """13.6.2: the other way back."""
    host = ClockHost()
    host.change(slits=Slits(-1_000, 200), origin=Span(-1_000, -900))
    await host.play("""
        &7FXRSM1
        >&7FXRS
        &3FQIS200
        >&3FQIS
        &3F00M
        >&3F00M
        >&7D00M[3F:00]
        &3F0QM
        >&3F0QM
        >&7D0QM[3F:00]
        &3FQSS1
        >&3FQSS
    """)
    host.change(slipped=100)
    await host.play("""
        &3F1+M500
        >&3F1+M
        >&7D1+M[3F:01]
        &3F00M
        >&3F00M
        >&7D00M[3F:00]
        &3F0QM
        >&3F0QM
        >&7D0QM[3F:00]
        &3F9CD
        >&3F9CDH00
        &3F1+M500
        >&3F1+M
        >&7D1+M[3F:00]
    """)


async def test_the_stall_sensor_with_a_normally_closed_contact() -> None:
    """13.6.2: DLS0,1."""
    host = ClockHost()
    await host.play("""
        &3FCLD0
        >&3FCLD0
        &3FDLS0,1
        >&3FDLS
        &3FCLD0
        >&3FCLD1
        &3FCLD
        >&3FCLDH01
    """)


# 13.7 The encoder


async def test_stall_detection_and_adjustment_by_the_encoder() -> None:
    """13.7.4, 13.7.5: 200 pulses a count, and a stall from 128 pulses on."""
    host = ClockHost()
    host.change(encoder=400.0)
    await host.play("""
        &3FPAS2
        >&3FPAS
        &3FEAS1
        >&3FEAS
        &3FPBS200.00
        >&3FPBS
        &3FPES128
        >&3FPES
        &3FPSS1
        >&3FPSS
        &3FPKS800
        >&3FPKS
        &3FPLS100
        >&3FPLS
        &3FPTS3
        >&3FPTS
        &3FPJS1
        >&3FPJS
        &7FXRSM1
        >&7FXRS
        &3F1+M10
        >&3F1+M
        >&7D1+M[3F:00]
        &3F6ED
        >&3F6ED+000000010
        &3F6MD
        >&3F6MD+000002000
    """)
    host.change(slipped=400)
    await host.play("""
        &3F1+M10
        >&3F1+M
        >&7D1+M[3F:01]
        &3FPRD
        >&3FPRD1
    """)


# 13.8 Status


async def test_the_bits_of_the_controller_status() -> None:
    """13.8.2: all but the pulses' are kept until 9CS."""
    host = ClockHost()
    host.change(cw_limit=Span(100, 200))
    await host.play("""
        &7FXRSM1
        >&7FXRS
        &3F1+M500
        >&3F1+M
        &3F9CD
        >&3F9CDH01
        >&7D1+M[3F:02]
        &3F9CD
        >&3F9CDH02
        &3F9CD1
        >&3F9CD1
        &3FXXX
        >&3FXXX@49
        &3F9CD
        >&3F9CDH0A
        &3FEPS-500,500
        >&3FEPS
        &3F1-MZ
        >&3F1-M
    """)
    host.wait(10)
    host.change(forced={EMS: True})
    await host.play("""
        >&7D1-M[3F:08]
        &3F9CD
        >&3F9CDH2E
        &3F9CS
        >&3F9CS
        &3F9CD
        >&3F9CDH00
    """)


async def test_the_causes_of_the_ends_of_moves() -> None:
    """13.8.3: cleared when the next move starts."""
    host = ClockHost()
    host.change(cw_limit=Span(100, 200), ccw_limit=Span(-200, -100))
    await host.play("""
        &7FXRSM1
        >&7FXRS
        &3F1-MZ
        >&3F1-M
        >&7D1-M[3F:04]
        &3F9MD
        >&3F9MDH04
        &3F1+MZ
        >&3F1+M
        &3F9MD
        >&3F9MDH00
        >&7D1+M[3F:02]
        &3F9MD
        >&3F9MDH02
        &3F2-M50
        >&3F2-M
        &3F5IS
        >&3F5IS
        >&7D2-M[3F:10]
        &3F9MD
        >&3F9MDH10
        &3F2-M50
        >&3F2-M
        >&7D2-M[3F:00]
        &3F9MD
        >&3F9MDH00
    """)


# 13.9 Inputs and outputs


async def test_input_logic_and_state() -> None:
    """13.9.3, 13.9.4."""
    host = ClockHost()
    host.change(inputs=0x3C)
    await host.play("""
        &3FCID
        >&3FCIDH003C
        &3FDIS0,1
        >&3FDIS
        &3FDIS9,1
        >&3FDIS
        &3FCID
        >&3FCIDH023D
    """)


async def test_an_interrupt_records_where_it_happened_and_gives_a_pulse() -> None:
    """13.9.4: once; then CPS is needed again."""
    host = ClockHost()
    await host.play("""
        &3FOLS1000
        >&3FOLS
        &3FCFS9,P:25
        >&3FCFS
        &3FCFS9,E:26
        >&3FCFS
        &3FCFS9,C:27
        >&3FCFS
        &3FCFS9,O:4,1,100
        >&3FCFS
        &3FCSS9,-50,5000
        >&3FCSS
        &3FCOS4,1
        >&3FCOS
        &3F3PSP[25],77
        >&3F3PS
        &3FCPS 9, 2
        >&3FCPS
        &3FCOD4
        >&3FCOD0
        &3F3PDP[25]
        >&3F3PD+000000000
        &3F2+M9000
        >&3F2+M
    """)
    host.wait(1.2345)
    host.change(inputs=0x200)
    await host.play("""
        &3FCOD4
        >&3FCOD1
        &3FCPD9
        >&3FCPD0
    """)
    host.wait(0.0995)
    assert await host.ask("&3FCOD4") == ">&3FCOD1"
    host.wait(0.001)
    host.change(inputs=0)
    host.change(inputs=0x200)
    await host.play("""
        &3FCOD4
        >&3FCOD0
        &3F3PDP[25]
        >&3F3PD+000001234
        &3F3PDP[26]
        >&3F3PD+000001234
        &3F3PDP[27]
        >&3F3PD+000001234
    """)


async def test_an_interrupt_outside_its_section_is_not_heeded() -> None:
    """13.9.4: -50 to 50 only."""
    host = ClockHost()
    await host.play("""
        &3FCFS8,P:25
        >&3FCFS
        &3FCSS8,-50,50
        >&3FCSS
        &3FCPS8,2
        >&3FCPS
        &3F2+M9000
        >&3F2+M
    """)
    host.wait(2)
    host.change(inputs=0x100)
    await host.play("""
        &3FCPD8
        >&3FCPD2
        &3F3PDP[25]
        >&3F3PD+000000000
    """)


async def test_the_clear_signal_of_servo_mode() -> None:
    """13.9.5, 17.4.1: by hand, and for 1 ms after a search, a stop, an error, and 5 s without INP."""
    host = ClockHost()
    outputs = host.line.axes[0x3F].io.outputs

    def pulse_begins() -> bool:
        begun = outputs.clear_signal()
        host.wait(0.0011)
        return begun and not outputs.clear_signal()

    await host.play("""
        &3FEAS2
        >&3FEAS
        &3FCCS1
        >&3FCCS
        &3FCLS1
        >&3FCLS
        &3FCOD
        >&3FCODH0000
    """)
    assert outputs.clear_signal()
    await host.play("""
        &3FCLS0
        >&3FCLS
        &7FXRSM1
        >&7FXRS
        &3F00M
        >&3F00M
        >&7D00M[3F:00]
    """)
    assert pulse_begins(), "the end of a search"
    await host.play("""
        &3F1+MZ
        >&3F1+M
        &3F5IS
        >&3F5IS
        >&7D1+M[3F:10]
    """)
    assert pulse_begins(), "an immediate stop"
    await host.play("""
        &3F1+M10
        >&3F1+M
        >&7D1+M[3F:00]
    """)
    host.wait(4.9995)
    assert not outputs.clear_signal()
    host.wait(0.001)
    assert pulse_begins(), "no INP"
    await host.play("""
        &3F1+MZ
        >&3F1+M
    """)
    host.change(forced={EMS: True})
    assert pulse_begins(), "an error"


async def test_outputs_and_their_pulses() -> None:
    """13.9.6: CBS turns an output over for its time."""
    host = ClockHost()
    await host.play("""
        &3FCOSH002F
        >&3FCOS
        &3FCOD
        >&3FCODH002F
        &3FCBS0,100
        >&3FCBS
        &3FCOD
        >&3FCODH002E
    """)
    host.wait(0.0999)
    assert await host.ask("&3FCOD0") == ">&3FCOD0"
    host.wait(0.0002)
    assert await host.ask("&3FCOD") == ">&3FCODH002F"


async def test_noise_shorter_than_its_count_is_not_seen() -> None:
    """13.9.7: input 1 has to be on for 5 ms."""
    host = ClockHost()
    await host.play("""
        &3FDCS1, 5
        >&3FDCS
    """)
    host.change(inputs=0x02)
    host.wait(0.0039)
    assert await host.ask("&3FCID1") == ">&3FCID0"
    host.change(inputs=0)
    host.wait(0.1)
    host.change(inputs=0x02)
    host.wait(0.0061)
    assert await host.ask("&3FCID1") == ">&3FCID1"
    await host.command("DCS1,1")
    host.change(inputs=0)
    assert await host.ask("&3FCID1") == ">&3FCID0"


async def test_misprinted_bits_are_refused_and_those_of_their_pages_accepted() -> None:
    """13.9.5 prints DLS1 for the logic of CLR, which is bit 6; 13.9.7 DCS15,1 for EMS, which is 14."""
    await ClockHost().play("""
        &3FDLS1
        >&3FDLS@4A
        &3FDLS6,1
        >&3FDLS
        &3FDLD6
        >&3FDLD1
        &3FDCS15, 1
        >&3FDCS@4A
        &3FDCS14, 1
        >&3FDCS
        &3FDCD14
        >&3FDCD001
    """)


async def test_an_error_drives_its_output_until_it_is_released() -> None:
    """13.9.8: D7 on after a STALL error, and no move while it stands."""
    host = ClockHost()
    await host.play(
        MOVE_ENDS_ON
        + """
        &3FCESS,7,1
        >&3FCES
        &3FCEDS
        >&3FCED7,1
    """
    )
    host.change(forced={STALL: True})
    await host.play("""
        &3F0QM
        >&3F0QM
        >&7D0QM[3F:01]
        &3FCOD7
        >&3FCOD1
        &3FQRS
        >&3FQRS
        &3F1+M10
        >&3F1+M@66
        &3FCRS
        >&3FCRS
        &3FCOD7
        >&3FCOD0
        &3F1+M10
        >&3F1+M
        >&7D1+M[3F:00]
        &3FCESS
        >&3FCES
        &3FCEDS
        >&3FCED
    """)


# 13.11 Event messages


async def test_changes_in_the_mask_are_reported_once_they_are_asked_for() -> None:
    """13.11.2: the EMS sensor or input 0, and only after XID."""
    host = ClockHost()
    await host.play("""
        &3FEMSS:H20,I:H0001
        >&3FEMS
        &3FESSM,I
        >&3FESS
    """)
    host.change(inputs=1)
    assert host.unheard() == ""
    await host.play("""
        &7FXID
        >&7FXID3F
    """)
    host.change(inputs=0)
    assert await host.hear() == ">&7EXED[3F:M:H00,I:H0000]"
    host.change(forced={EMS: True})
    assert await host.hear() == ">&7EXED[3F:M:H00,I:H0000]"
    host.change(inputs=2, forced={EMS: True, CW_LIMIT: True})
    assert host.unheard() == ""
    host.change(inputs=3)
    assert await host.hear() == ">&7EXED[3F:M:H00,I:H0003]"


async def test_an_event_carries_the_chosen_states_and_erd_answers_the_same() -> None:
    """13.11.3: the printed event message comes from a STALL error."""
    host = ClockHost()
    host.change(forced={STALL: True})
    await host.play("""
        &7FXID
        >&7FXID3F
        &3FEMSM:H1F
        >&3FEMS
        &3FESSM,I
        >&3FESS
        &3F0QM
        >&3F0QM
        >&7EXED[3F:M:H01,I:H0000]
        &3FERD
        >&3FERDM:H01,I:H0000
    """)


async def test_every_state_an_event_can_carry() -> None:
    """13.11.3: controller status, end cause, sensors, inputs, outputs and position."""
    host = ClockHost()
    host.change(inputs=0x3C, cw_limit=Span(500, 600))
    await host.play("""
        &7FXID
        >&7FXID3F
        &3FCOSH0102
        >&3FCOS
        &3FEMSC:H06
        >&3FEMS
        &3FESSC,M,S,I,O,P
        >&3FESS
        &3F1+M1000
        >&3F1+M
        >&7EXED[3F:C:H02,M:H02,S:H04,I:H003C,O:H0102,P:+000000500]
    """)
