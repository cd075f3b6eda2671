"""The catalogue of faults: what can go wrong, what the gateway does then, and the tests that prove it."""

from typing import Final, NamedTuple

ACCESS = "api/access/test_access"
ADMISSION = "api/front/test_connections"
AHEAD = "e2e/test_requests_ahead"
BIT_FLIPS = "bit_flips/test_bit_flips"
BODY_POWER = "gateway/rorze/test_body_power"
BREAKDOWNS = "e2e/test_breakdowns"
CORE_LEASES = "gateway/core/test_leases"
DISK = "gateway/core/journal/test_disk"
DPRAM_FAULTS = "gateway/fics/test_dpram_faults"
DURATIONS = "gateway/fics/test_durations"
ERRORS = "gateway/rorze/test_internal_errors"
EVENTS = "gateway/core/test_events"
FAULTY_LINE = "simulation/test_faulty_line"
FAULT_SIMULATOR = "fault_simulator/test_fault_simulator"
FILES = "gateway/core/journal/test_files"
FULL_DISK = "e2e/test_full_disk"
HOSTILE = "e2e/test_hostile_http"
HTTP = "api/front/test_http_protocol"
INDEX = "gateway/rorze/test_index_steps"
INTENTS = "gateway/core/journal/test_intents"
JOURNAL = "gateway/core/journal/test_journal"
JSON = "api/common/test_strict_json"
KILLS = "e2e/test_kills"
LIFE = "e2e/test_life"
LINE = "gateway/rorze/test_line"
LINES = "protocols/test_lines"
ECHO = "gateway/test_echoing_lines"
LINK = "protocols/rorze/test_link"
LOOP_WATCH = "gateway/core/test_admission"
MEMORY = "gateway/test_memory"
MOVES = "gateway/rorze/test_moves"
OPENING = "gateway/core/journal/test_opening"
PLANT = "gateway/test_plant"
PORT_LOOP = "gateway/core/test_port_loop"
PROOF = "gateway/rorze/test_move_proof"
READINGS = "gateway/rorze/test_readings"
REPEATS = "api/common/test_idempotent_requests"
RESUMING = "api/test_resuming"
RING = "gateway/core/test_event_ring"
ROBOT_FAULTS = "gateway/fics/test_faults"
ROBOT_INFO = "api/robots/test_info"
SCARA_MOVES = "gateway/rorze_scara/test_moves"
SCHEDULER = "gateway/core/test_scheduler"
SCHEMA = "gateway/core/journal/test_schema"
SERIAL = "transports/test_serial_port"
SERVER = "app/test_server"
SERVER_KILLS = "e2e/test_kills_of_the_server"
SERVO = "api/bodies/test_servo"
START_POSITIONS = "gateway/rorze_scara/test_start_positions"
STARVATION = "api/test_starvation"
STOPS = "gateway/rorze/test_stops"
STORIES = "catalogue/test_stories"
STREAMS = "api/test_streams"
SUSPENSION = "gateway/rorze/test_suspension"
TRANSPORTS = "transports/test_contract"
UNDER_LOAD = "e2e/test_stop_under_load"
UPGRADE = "gateway/test_upgrade"
WEBSOCKET = "api/front/test_websocket_protocol"
WIND_DOWN = "gateway/test_wind_down"


class Row(NamedTuple):
    """A fault, what is done about it, and the tests, each as file::name."""

    fault: str
    answer: str
    tests: tuple[str, ...]


def _row(fault: str, answer: str, *tests: tuple[str, str]) -> Row:
    return Row(fault, answer, tuple(f"tests/{file}.py::test_{name}" for file, name in tests))


ROWS: Final = {
    "S01": _row(
        "a command is lost",
        "the line is fenced; the motor proves that nothing was executed; nothing is sent again",
        (PROOF, "a_lost_command_is_found_not_executed_and_not_sent_again"),
    ),
    "S02": _row(
        "a reply is lost",
        "the same, and the motor proves that the move is made",
        (PROOF, "a_lost_reply_is_made_good_by_the_running_motor"),
        (PROOF, "a_lost_reply_is_made_good_by_a_motor_that_stands_at_the_target"),
    ),
    "S03": _row(
        "a reply is late, and comes before the fence",
        "it belongs to the old command",
        (LINE, "a_late_reply_before_the_fence_belongs_to_the_old_command"),
    ),
    "S04": _row(
        "a reply is late, and comes after the fence",
        "it is dropped and counted",
        (LINE, "a_late_reply_after_the_fence_is_dropped_and_counted"),
    ),
    "S05": _row(
        "a late reply would fit the next command",
        "that is not sent before a fence has passed",
        (LINE, "after_a_timeout_nothing_is_sent_before_a_fence_has_passed"),
        (LINE, "between_two_equal_commands_goes_a_fence"),
    ),
    "S06": _row(
        "a reply comes twice at once",
        "the second is dropped, and the line brackets what it acknowledges with fences",
        (LINE, "a_doubled_reply_is_never_taken_for_the_next_one"),
        (LINE, "a_line_that_says_replies_twice_tells_so_and_brackets_what_it_acknowledges"),
    ),
    "S07": _row(
        "a reply comes a second time, later",
        "no move changes by it",
        (FAULTY_LINE, "what_is_believed_on_a_wire_that_says_replies_twice_is_true"),
    ),
    "S08": _row(
        "one bit is flipped in the body or code of a reply",
        "it is not credited",
        (BIT_FLIPS, "the_page_in_the_docs_is_up_to_date"),
        (LINE, "a_garbled_reply_calls_for_the_fence_at_once"),
    ),
    "S09": _row(
        "one bit is flipped in a digit of a reply",
        "nothing is decided by one reading on a line that errs",
        (READINGS, "two_equal_readings_in_a_row_are_believed_on_a_line_that_errs"),
        (PROOF, "one_garbled_position_does_not_make_a_good_move_fail"),
        (PROOF, "one_garbled_status_does_not_end_a_move_that_runs"),
        (STOPS, "one_garbled_status_does_not_confirm_a_stop"),
    ),
    "S10": _row(
        "one bit is flipped in a digit of a command",
        "the final position tells",
        (PROOF, "a_garbled_distance_is_found_by_the_final_position"),
    ),
    "S11": _row(
        "one bit turns the body into another",
        "the one has not moved, the other's motion is told as foreign",
        (STORIES, "s11_a_bit_that_turns_a_body_into_another_moves_that_and_both_are_told"),
    ),
    "S12": _row(
        "the CR of a command is lost",
        "it makes no command with what follows; an opening poisons what may be left",
        (BIT_FLIPS, "what_the_far_end_makes_of_it"),
        (LINK, "the_poison_makes_every_cut_command_too_long"),
    ),
    "S13": _row(
        "the CR of a reply is lost",
        "it is dropped, and the next reply is read",
        (LINK, "a_reply_that_lost_its_end_does_not_take_the_next_with_it"),
    ),
    "S14": _row(
        "stray CR and LF",
        "they are nothing",
        (LINK, "stray_ends_of_line_are_nothing"),
    ),
    "S15": _row(
        "noise between frames",
        "the next frame is read; one exchange is lost at most",
        (LINK, "after_any_noise_and_an_end_of_line_the_next_frame_is_read"),
        (LINE, "noise_does_not_use_up_the_tries_of_a_fence"),
    ),
    "S16": _row(
        "noise without an end",
        "it costs one exchange and no memory",
        (LINE, "a_flood_without_an_end_costs_one_exchange_and_no_memory"),
        (LINES, "a_flood_without_an_end_is_not_kept"),
    ),
    "S17": _row(
        "a reply comes byte by byte",
        "it is waited for, but not for ever",
        (LINE, "a_reply_that_comes_in_pieces_is_waited_for_but_not_for_ever"),
    ),
    "S18": _row(
        "a reply is split anywhere",
        "that makes no difference",
        (LINK, "how_replies_are_split_makes_no_difference"),
    ),
    "S19": _row(
        "the speed of the port is wrong",
        "the line is down and says that it hears garbage",
        (LINE, "a_line_that_answers_in_garbage_says_so"),
    ),
    "S20": _row(
        "our own frames come back",
        "they are no replies; the line is told as unusable and asked once a second, and stops are sent",
        (LINK, "an_echo_of_our_own_command_is_named"),
        (ECHO, "a_line_that_echoes_is_told_once_and_asked_a_few_times_a_second"),
        (ECHO, "a_stop_is_confirmed_by_the_true_replies_beside_the_echoes"),
    ),
    "S21": _row(
        "the cable is pulled in the middle of a frame",
        "the half command is poisoned before anything else is said",
        (LINE, "an_opening_poisons_what_was_left_half_sent_and_then_tells_the_link_master_everything"),
        (LINK, "the_poison_makes_every_cut_command_too_long"),
    ),
    "S22": _row(
        "the adapter is unplugged",
        "what was written is not known, what waited was not sent; the port is tried again and again",
        (LINE, "when_the_port_is_lost_what_waited_was_not_sent_and_what_was_written_is_not_known"),
        (LINE, "a_missing_port_is_tried_again_with_longer_and_longer_pauses"),
    ),
    "S23": _row(
        "another program opens the port",
        "it is refused to it, or to us",
        (SERIAL, "a_port_in_use_is_refused_until_it_is_closed"),
    ),
    "S24": _row(
        "the port takes no bytes",
        "it is opened anew; a stop that was not sent is called so",
        (LINE, "a_port_that_takes_no_bytes_is_opened_anew"),
        (STOPS, "a_stop_on_a_line_that_is_down_says_that_it_was_not_sent_and_goes_out_when_it_is_up"),
    ),
    "S25": _row(
        "the port takes a part of a frame",
        "the rest follows, and nothing is thrown away",
        (TRANSPORTS, "a_large_write_arrives_whole_and_is_unsent_until_it_is_taken"),
        (PORT_LOOP, "a_port_that_takes_bytes_now_and_then_is_not_stuck"),
    ),
    "S26": _row(
        "a stop is asked for while a frame is on the wire",
        "it goes directly after that frame, never inside",
        (LINE, "a_stop_waits_for_the_frame_boundary_and_not_for_the_reply"),
        (UNDER_LOAD, "a_stop_is_the_next_frame_and_nothing_moves_after_it"),
    ),
    "S27": _row(
        "a stop is asked for while a dead body is waited for",
        "it goes within a frame's time",
        (STOPS, "a_stop_does_not_wait_for_a_body_that_does_not_answer"),
    ),
    "S28": _row(
        "a stop is lost",
        "it is repeated until standstill is proved",
        (STOPS, "a_lost_stop_or_a_lost_reply_to_it_is_made_good"),
    ),
    "S29": _row(
        "the reply to a stop is lost",
        "the state confirms it",
        (STOPS, "a_lost_stop_or_a_lost_reply_to_it_is_made_good"),
    ),
    "S30": _row(
        "a thousand stops at once",
        "they are one",
        (STOPS, "a_thousand_stops_at_once_are_one"),
    ),
    "L01": _row(
        "the link master loses its power while all is at rest",
        "it is set up anew",
        (PLANT, "a_link_master_that_restarts_while_all_is_quiet_is_set_up_again"),
        (BREAKDOWNS, "a_link_master_that_loses_its_power_for_a_moment"),
    ),
    "L02": _row(
        "the link master loses its power while a motor moves",
        "the motor moves on, and its end is found by asking",
        (PLANT, "a_move_runs_on_while_the_link_master_is_without_power"),
        (BREAKDOWNS, "a_link_master_that_is_without_power_for_a_while"),
    ),
    "L03": _row(
        "the link master has forgotten a group that is stopped",
        "each member is stopped by a frame of its own",
        (STOPS, "the_members_of_a_forgotten_group_are_stopped_nevertheless"),
    ),
    "L04": _row(
        "the reply of a group lacks a member",
        "that member is asked itself",
        (LINE, "a_group_reply_gives_each_member_its_own_and_the_missing_member_nothing"),
        (MOVES, "a_member_that_the_reply_leaves_out_is_asked_itself"),
    ),
    "L05": _row(
        "a member of a group refuses",
        "its move alone is rejected",
        (MOVES, "a_member_that_refuses_has_a_rejected_move_of_its_own"),
    ),
    "L06": _row(
        "the end of a move is not announced",
        "it is found by asking, and the link master set up anew",
        (MOVES, "without_announcements_the_end_is_found_by_polling_and_the_link_set_up_again"),
    ),
    "L07": _row(
        "the end of an earlier move is announced again",
        "the present one goes on",
        (MOVES, "a_late_announcement_of_an_earlier_end_does_not_end_the_move"),
    ),
    "L08": _row(
        "something unasked comes between a command and its reply",
        "it is an event, and the reply is the reply",
        (LINE, "messages_nobody_asked_for_never_complete_an_exchange_and_are_passed_on"),
    ),
    "L09": _row(
        "events come 500 times a second",
        "each is told; stops and moves do not notice",
        (STORIES, "l09_a_storm_of_events_delays_no_stop_and_disturbs_no_move"),
    ),
    "L10": _row(
        "a command is longer than 60 characters",
        "it is not sent; a refusal is told with its code",
        (LINK, "sixty_characters_are_sent_and_sixty_one_are_not"),
        (LINE, "a_refusal_is_told_with_its_code_if_there_is_one"),
    ),
    "L11": _row(
        "the link to a controller has garbled a command (4B)",
        "it was not executed; reads alone are repeated",
        (ERRORS, "a_move_that_meets_an_error_is_rejected_and_nothing_moves"),
        (ERRORS, "the_remedy_says_who_or_what_to_look_at"),
    ),
    "L12": _row(
        "a reply overtakes another",
        "each is credited to its own command or, behind its fence, to none, and that is told",
        (STORIES, "l12_a_reply_that_overtakes_another_is_credited_to_its_own_command"),
        (STORIES, "l12_a_reply_that_its_fence_has_overtaken_is_credited_to_nothing_and_told"),
        (STORIES, "l12_a_robot_whose_answers_come_out_of_order_is_told"),
    ),
    "L13": _row(
        "the link master drops what is sent before its reply",
        "stops are sent again, or after replies where the configuration says so",
        (STOPS, "a_link_master_that_drops_interjected_stops_gets_them_again"),
        (LINE, "a_link_that_takes_no_frame_before_its_reply_gets_stops_after_replies"),
    ),
    "C01": _row(
        "a body is absent",
        "it is offline after three fences, and the others go on",
        (LINE, "a_body_that_fails_three_fences_is_offline_and_the_others_go_on"),
        (LINE, "probes_of_a_dead_body_become_rarer"),
    ),
    "C02": _row(
        "a body comes back",
        "probes find it, and its mark tells whether its power was kept",
        (LINE, "a_body_that_is_back_is_found_by_the_probes"),
        (BODY_POWER, "a_body_that_was_silent_and_kept_its_mark_has_kept_its_power"),
    ),
    "C03": _row(
        "a body loses its power at rest",
        "moves to a place are refused until it was homed",
        (BODY_POWER, "after_a_loss_of_power_at_rest_an_absolute_move_is_refused"),
        (BODY_POWER, "homing_ends_the_refusal"),
    ),
    "C04": _row(
        "a body loses its power in motion",
        "the move is lost, and nothing is homed",
        (PROOF, "a_body_that_lost_its_power_in_the_middle_has_lost_its_move"),
    ),
    "C05": _row(
        "a user program starts with the power",
        "its motion is told as foreign, and a stop ends it with its program",
        (STORIES, "c05_a_program_that_starts_with_the_power_is_told_and_a_stop_ends_it"),
    ),
    "C06": _row(
        "a user program moves on after a stop",
        "the stop ends it, and is confirmed only then",
        (STOPS, "a_user_program_is_ended_too_lest_it_starts_the_next_move"),
        (STOPS, "a_stop_is_not_confirmed_while_a_program_runs_that_could_move_on"),
    ),
    "C07": _row(
        "the controller refuses a move",
        "nothing moves, and it says why",
        (MOVES, "a_refusal_moves_nothing_and_says_why"),
        (ERRORS, "a_move_that_meets_an_error_is_rejected_and_nothing_moves"),
    ),
    "C08": _row(
        "a limit, EMS or a stall ends a move",
        "it has failed, with the cause",
        (MOVES, "a_sensor_ends_a_move_as_failed_with_its_cause"),
        (MOVES, "a_stall_ends_a_move_as_failed"),
    ),
    "C09": _row(
        "the stall bit was cleared, and its finder stays",
        "moves are refused until that is cleared, too",
        ("api/bodies/test_homing", "the_status_names_who_has_found_a_stall_and_the_route_that_clears_it"),
        ("contract/test_manual_sequences", "a_stall_is_noticed_and_stops_every_move_until_it_is_cleared"),
    ),
    "C10": _row(
        "two bodies have one number",
        "what they say over each other is not credited; nothing is sent to move them, and the others go on",
        (STORIES, "c10_two_bodies_with_one_number_are_not_understood_and_not_moved"),
    ),
    "C11": _row(
        "the position index is at its end",
        "the move is refused, and not repeated",
        (STORIES, "c11_the_end_of_the_position_index_refuses_a_move_and_nothing_is_repeated"),
    ),
    "C12": _row(
        "nobody knows what became of a step of the position index",
        "nothing is repeated, and the remedy says what to read",
        (INDEX, "without_a_reply_the_remedy_says_what_to_read"),
    ),
    "C13": _row(
        "one axis of an interpolated move is stopped",
        "its group is stopped with it",
        (STOPS, "an_axis_of_an_interpolated_move_takes_its_group_with_it"),
    ),
    "C14": _row(
        "the preparation of an interpolated move is out of date",
        "the positions that were told are read again; where an axis stands elsewhere nothing is started",
        (START_POSITIONS, "what_has_changed_since_the_preparation_keeps_the_move_from_starting"),
        (SCARA_MOVES, "an_axis_that_has_moved_since_is_not_started"),
    ),
    "C15": _row(
        "flash memory is to be written while another body moves",
        "it is refused before anything is sent",
        (PLANT, "flash_waits_for_the_whole_line_to_stand_still"),
    ),
    "C16": _row(
        "the power is lost while flash memory is written",
        "the status shows it, and nothing goes to a place",
        (ERRORS, "settings_found_wrong_at_power_on_show_in_the_status_and_nothing_goes_to_a_place"),
    ),
    "C17": _row(
        "a move is shorter than a poll",
        "its end is not missed",
        (STORIES, "c17_a_move_that_is_shorter_than_a_poll_is_not_missed"),
    ),
    "C18": _row(
        "another host moves a body",
        "that is told, and no move is sent",
        (PLANT, "motion_that_nobody_here_asked_for_is_reported_once_and_forgets_the_position"),
        (MOVES, "a_body_that_another_host_moves_is_sent_nothing_and_is_known_to_move"),
    ),
    "C19": _row(
        "INP does not come",
        "the move goes on until it is sure to have failed",
        (SERVO, "a_move_goes_on_until_the_drive_is_in_position"),
        (SERVO, "a_drive_that_never_arrives_fails_the_move"),
    ),
    "C20": _row(
        "somebody writes into the comment of the mark",
        "the text is left alone; a mark that has gone counts as a loss of power",
        (BODY_POWER, "a_comment_with_somebodys_own_text_is_left_alone_and_told_once"),
        (BODY_POWER, "where_position_0_proves_nothing_the_mark_does"),
    ),
    "H01": _row(
        "a robot loses its power",
        "nothing moves until somebody has acknowledged it",
        (ROBOT_FAULTS, "h01_after_a_power_cycle_nothing_moves_until_somebody_knows_of_it"),
        (ROBOT_FAULTS, "h01_a_power_cycle_is_noticed_even_when_nothing_is_asked"),
        (ROBOT_FAULTS, "h01_a_move_that_lost_its_power_is_lost"),
    ),
    "H02": _row(
        "nobody knows which unit is selected",
        "nothing moves before the robot has named the right one",
        (ROBOT_FAULTS, "h02_without_a_verified_unit_nothing_moves"),
        (ROBOT_FAULTS, "h02_a_unit_that_the_robot_did_not_hear_is_selected_again_or_nothing_moves"),
    ),
    "H03": _row(
        "the terminal selects another unit",
        "that is noticed before a move",
        (ROBOT_FAULTS, "h03_a_unit_changed_behind_our_back_is_noticed_before_the_move"),
    ),
    "H04": _row(
        "a crash leaves an upload open",
        "it is closed first, and stops work",
        (ROBOT_FAULTS, "h04_an_upload_left_open_by_an_earlier_life_is_closed_first"),
        (ROBOT_FAULTS, "h04_an_upload_whose_end_was_refused_takes_neither_the_robot_nor_its_stops_away"),
        (ROBOT_FAULTS, "h04_a_stop_ends_an_upload_that_is_open_behind_our_back"),
    ),
    "H05": _row(
        "a stop is asked for in an upload",
        "the upload is closed, and the stop follows",
        (ROBOT_FAULTS, "h05_a_stop_in_an_upload_closes_it_first"),
    ),
    "H06": _row(
        "the terminal makes the robot refuse a stop",
        "it is repeated and never called confirmed",
        (ROBOT_FAULTS, "h06_a_stop_refused_by_the_teaching_terminal_is_never_called_confirmed"),
        (ROBOT_FAULTS, "h06_in_mode_2_the_refusal_of_a_stop_is_heard_before_units_are_selected"),
    ),
    "H07": _row(
        "a stop comes while axes brake",
        "refused or not, it is confirmed by standstill",
        (ROBOT_FAULTS, "h07_an_immediate_stop_while_axes_brake_is_confirmed_refused_or_not"),
    ),
    "H08": _row(
        "the reply to a stop overtakes that of the move",
        "each is credited to its own command",
        (ROBOT_FAULTS, "h08_the_answer_to_the_stop_comes_before_that_of_the_move"),
    ),
    "H09": _row(
        "a robot in mode 2 does not answer, as it should",
        "the end is inferred from what it tells of its axes",
        (ROBOT_FAULTS, "h09_in_mode_2_silence_is_no_error_and_the_end_is_inferred"),
    ),
    "H10": _row(
        "the answer that told an error is lost",
        "the error is not asked for again but found in the details",
        (ROBOT_FAULTS, "h10_a_lost_error_is_never_asked_for_again_but_found_in_the_details"),
        (ROBOT_FAULTS, "h10_all_who_ask_hear_that_the_error_is_gone"),
    ),
    "H11": _row(
        "an axis is not homed",
        "it has no position, and takes no move to a place",
        (ROBOT_FAULTS, "h11_an_unhomed_axis_has_no_position_and_takes_no_absolute_move"),
        (ROBOT_INFO, "a_position_that_is_not_known_is_null_with_the_reason"),
    ),
    "H12": _row(
        "a move lasts for minutes",
        "it is followed to its end; that it takes too long is told",
        (ROBOT_FAULTS, "h12_a_move_of_minutes_is_followed_to_its_end"),
        (DURATIONS, "h12_a_move_that_takes_longer_is_told_and_followed_to_its_end"),
    ),
    "H13": _row(
        "the dual-port RAM has an answer of an earlier life",
        "it is thrown away",
        (DPRAM_FAULTS, "h13_an_answer_left_from_an_earlier_life_is_thrown_away"),
    ),
    "H14": _row(
        "Fics takes nothing from the dual-port RAM",
        "the line is down; a stop is not called sent",
        (DPRAM_FAULTS, "h14_a_flag_that_stays_at_1_takes_the_line_down_and_a_stop_is_not_called_sent"),
        (DPRAM_FAULTS, "h14_a_move_that_fics_has_not_taken_is_not_carried_out_after_a_stop"),
        (ROBOT_FAULTS, "h14_a_port_that_takes_nothing_is_told_and_a_stop_through_it_is_not_called_sent"),
    ),
    "H15": _row(
        "Fics writes while the host reads",
        "nothing is read before it is whole",
        (DPRAM_FAULTS, "h15_no_answer_is_read_while_it_is_being_written"),
    ),
    "H16": _row(
        "a crash comes between the data and its flag",
        "the command is never carried out",
        (DPRAM_FAULTS, "h16_a_command_without_its_flag_is_never_carried_out"),
    ),
    "H17": _row(
        "the dual-port RAM vanishes",
        "the line is down, the gateway lives, and a move is followed on afterwards",
        (DPRAM_FAULTS, "h17_a_ram_that_vanishes_takes_the_line_down_and_not_the_gateway"),
        (DPRAM_FAULTS, "h17_a_move_is_followed_on_after_the_ram_has_come_back"),
    ),
    "G01": _row(
        "kill -9 before the intent is durable",
        "nothing was sent; a repeat with its key is carried out once",
        (MEMORY, "a_move_that_was_never_written_is_cancelled"),
        (REPEATS, "a_crash_before_the_intent_leaves_the_key_free"),
    ),
    "G02": _row(
        "kill -9 between the intent and the write",
        "it is proved not to have been executed, and never sent again",
        (MEMORY, "an_intent_without_a_frame_proves_itself_not_executed"),
        (REPEATS, "a_crash_between_the_intent_and_the_answer_makes_no_second_move"),
    ),
    "G03": _row(
        "kill -9 after the write",
        "the move is followed to its end in its own record",
        (MEMORY, "a_move_goes_on_in_its_own_record_after_a_crash"),
        (BREAKDOWNS, "a_move_outlives_the_gateway_that_began_it"),
        (KILLS, "an_engine_that_is_killed_500_times_does_nothing_twice_and_forgets_nothing"),
        (SERVER_KILLS, "a_server_that_is_killed_60_times_does_nothing_twice_and_forgets_nothing"),
    ),
    "G04": _row(
        "kill -9 in the middle of a frame",
        "the half command is poisoned when the port is opened",
        (LINE, "an_opening_poisons_what_was_left_half_sent_and_then_tells_the_link_master_everything"),
        (BREAKDOWNS, "a_gateway_that_is_killed_in_a_move"),
    ),
    "G05": _row(
        "kill -9 during a stop",
        "the motor stands, and the move has a true end",
        (STORIES, "g05_a_stop_that_a_crash_has_interrupted_has_stopped_the_motor"),
    ),
    "G06": _row(
        "SIGTERM while moves wait",
        "they are never sent",
        (WIND_DOWN, "a_move_that_waits_for_the_line_is_never_sent"),
        (LIFE, "what_would_never_end_is_stopped_and_what_goes_on_is_named"),
    ),
    "G07": _row(
        "the process is held for seconds",
        "what waited is cancelled, and does not begin late",
        (SUSPENSION, "a_move_that_waits_for_the_line_does_not_begin_late"),
    ),
    "G08": _row(
        "the process is suspended and goes on",
        "nothing of before begins to move",
        (LIFE, "what_was_asked_for_while_the_process_was_suspended_does_not_begin_late"),
    ),
    "G09": _row(
        "a second gateway is started",
        "it does not start",
        (DISK, "two_gateways_never_share_a_directory"),
        (BREAKDOWNS, "a_second_gateway_at_the_same_port"),
    ),
    "G10": _row(
        "the process has no file descriptors left",
        "lines and stops go on",
        ("e2e/test_hostile_http", "a_gateway_without_file_descriptors_goes_on"),
    ),
    "G11": _row(
        "memory is short",
        "whatever waits or is kept has a bound",
        (SCHEDULER, "a_full_queue_refuses_but_for_stops_and_for_reads_that_join_one"),
        (RING, "the_newest_are_kept_and_no_others"),
        (INTENTS, "no_more_wait_for_the_disk_than_may_wait_for_a_body"),
    ),
    "G12": _row(
        "the processor is taken by other programs",
        "a stop goes out in few turns of the event loop, whatever waits; a lag is told from 0.25 s on",
        (STARVATION, "a_stop_goes_out_in_few_turns_whatever_waits"),
        (STARVATION, "a_lag_is_told_and_what_moves_is_followed_and_stopped"),
    ),
    "A01": _row(
        "a client repeats a request with the same key",
        "it is carried out once, over restarts too",
        (REPEATS, "a_repeat_gets_the_same_answer"),
        (REPEATS, "over_a_restart_the_answer_is_the_same"),
    ),
    "A02": _row(
        "the same key comes with another request",
        "422",
        (REPEATS, "the_same_key_with_another_request_is_refused"),
    ),
    "A03": _row(
        "a hundred requests come at once with one key",
        "one move, and a hundred equal answers",
        (REPEATS, "a_hundred_at_once_make_one_move"),
        (REPEATS, "a_hundred_after_a_kill_behind_the_intent_get_the_one_move"),
    ),
    "A04": _row(
        "a client leaves while it waits for the end",
        "the move goes on in its record",
        (AHEAD, "a_move_goes_on_when_the_client_that_waits_for_its_end_has_left"),
    ),
    "A05": _row(
        "a number is no number, or a key comes twice",
        "422",
        (JSON, "what_could_mean_something_else_is_422"),
        (HOSTILE, "a_distance_that_is_no_whole_number"),
        (HOSTILE, "a_move_that_is_none"),
    ),
    "A06": _row(
        "JSON is endless, deep, or not JSON",
        "4xx",
        (JSON, "what_is_no_json_is_400"),
        ("gateway/door/test_strict_json", "every_number_that_is_read_is_finite"),
        (JSON, "a_body_over_64_kib_is_413"),
        (HOSTILE, "too_many_bytes"),
    ),
    "A07": _row(
        "a text would become another frame",
        "422, and the codec would refuse it, too",
        (HOSTILE, "commands_that_would_become_other_frames"),
        (LINK, "one_frame_never_becomes_two"),
    ),
    "A08": _row(
        "an address is odd",
        "it is that of somebody, or refused",
        (HOSTILE, "addresses_of_nobody"),
        (HOSTILE, "an_address_in_percent_signs_is_the_same_address"),
    ),
    "A09": _row(
        "a head or a body comes slowly",
        "the connection ends in time",
        (HTTP, "a_slow_head_ends_in_time"),
        (HTTP, "a_byte_now_and_then_makes_a_head_no_faster"),
        (HTTP, "a_slow_body_ends_in_time_and_nothing_is_done"),
    ),
    "A10": _row(
        "many clients move and read without a pause",
        "a stop is the next frame",
        (UNDER_LOAD, "a_stop_is_the_next_frame_and_nothing_moves_after_it"),
        (STARVATION, "a_stop_goes_out_in_few_turns_whatever_waits"),
    ),
    "A11": _row(
        "the gateway has as many requests as it takes",
        "stops are taken nevertheless",
        (ADMISSION, "beyond_the_limit_there_are_only_stops_and_then_nothing"),
        (HTTP, "at_the_limit_only_stops_are_served"),
    ),
    "A12": _row(
        "a WebSocket is not read",
        "it is closed at a bound, and can be resumed",
        (STREAMS, "a_client_that_does_not_read_is_closed_and_can_go_on_later"),
        (WEBSOCKET, "who_does_not_read_loses_the_socket_for_good"),
    ),
    "A13": _row(
        "a client vanishes while events are replayed",
        "the gateway goes on",
        (EVENTS, "lets_the_rest_of_the_gateway_run_while_it_replays"),
        (WEBSOCKET, "who_has_left_leaves_nothing_to_the_garbage_collector"),
    ),
    "A14": _row(
        "a client resumes after it has missed events",
        "without a gap, or with one that is told",
        (RESUMING, "a_thousand_breaks_lose_and_reorder_nothing"),
        (STREAMS, "a_cursor_of_another_life_is_answered_with_a_gap"),
        (MEMORY, "cursors_go_on_without_a_gap"),
    ),
    "A15": _row(
        "a WebSocket breaks the protocol",
        "its code closes it, and others go on",
        (WEBSOCKET, "a_broken_frame_is_answered_with_its_code"),
        (WEBSOCKET, "frames_before_the_handshake_is_answered"),
    ),
    "A16": _row(
        "a lease ends between admission and write",
        "nothing is written",
        (CORE_LEASES, "what_was_admitted_is_not_written_after_the_lease"),
    ),
    "A17": _row(
        "the holder of a lease comes back with its old token",
        "it is refused",
        (CORE_LEASES, "a_lease_ends_with_its_time_and_its_token_with_it"),
    ),
    "A18": _row(
        "a stop comes without a lease, with a viewer's key, beyond all limits",
        "it goes",
        (ACCESS, "a_key_at_its_limits_still_stops_and_others_go_on"),
        (CORE_LEASES, "stops_pass_and_so_does_what_follows_a_move_to_its_end"),
    ),
    "A19": _row(
        "the wall clock jumps by a year",
        "nothing but the times that are told",
        (FAULT_SIMULATOR, "a_seed_sends_the_same_again_whatever_the_wall_clock_does"),
        (LOOP_WATCH, "the_clock_of_the_computer_goes_on_and_never_back"),
        (MEMORY, "moves_go_on_in_their_order_where_the_clock_was_a_year_ahead"),
        (FILES, "what_a_wall_clock_has_dated_a_year_early_or_late_is_kept"),
    ),
    "J01": _row(
        "the disk is full",
        "what has an effect is refused until there is room; stops go",
        (JOURNAL, "a_full_disk_refuses_what_has_an_effect_until_there_is_room"),
        (OPENING, "a_disk_that_cannot_be_written_at_the_start_is_used_when_it_can"),
        (FULL_DISK, "what_has_an_effect_waits_for_room_and_stops_do_not"),
        (INTENTS, "a_stop_waits_for_no_disk_and_is_written_down_afterwards"),
    ),
    "J02": _row(
        "the disk fails",
        "it is not trusted again before a restart",
        (JOURNAL, "a_disk_that_has_failed_is_not_trusted_again"),
    ),
    "J03": _row(
        "the disk is slow",
        "a command waits no longer than it may, a stop not at all",
        (INTENTS, "a_disk_that_is_slower_than_the_command_may_wait_lets_it_expire"),
        (JOURNAL, "a_disk_that_takes_its_time_is_not_waited_for"),
        (INTENTS, "a_stop_waits_for_no_disk_and_is_written_down_afterwards"),
    ),
    "J04": _row(
        "the journal is damaged",
        "it is set aside, and that is told",
        (DISK, "a_damaged_page_is_found_and_the_file_set_aside"),
        (MEMORY, "a_broken_journal_is_set_aside_and_that_is_told"),
        (MEMORY, "a_sound_file_that_makes_no_sense_is_set_aside_too"),
    ),
    "J05": _row(
        "the journal is deleted while the gateway runs",
        "that is noticed, and what has an effect is refused",
        (JOURNAL, "a_file_that_has_gone_is_noticed"),
    ),
    "J06": _row(
        "the directory cannot be written at the start",
        "there are reads and stops only, until it can be written",
        (MEMORY, "without_a_directory_reads_and_stops_go_on"),
        (OPENING, "a_disk_that_cannot_be_written_at_the_start_is_used_when_it_can"),
        (DISK, "a_directory_that_cannot_be_written_says_so"),
    ),
    "J07": _row(
        "the computer loses its power, and the disk what was not synced",
        "every frame on the wire has its intent nevertheless",
        (FAULT_SIMULATOR, "whatever_goes_wrong_what_is_told_is_true"),
        (INTENTS, "the_first_byte_comes_after_the_intent_is_durable"),
    ),
    "J08": _row(
        "the journal has its full size",
        "the oldest that is over is forgotten, and nothing that is open, no key either",
        (STORIES, "j08_only_keys_that_are_old_and_answered_are_forgotten"),
        (FILES, "what_is_too_much_or_too_old_is_forgotten_and_what_is_open_is_kept"),
    ),
    "J09": _row(
        "the journal was written by an earlier version",
        "all of it is taken over",
        (UPGRADE, "all_that_an_earlier_gateway_has_written_is_taken_over"),
        (SCHEMA, "what_an_earlier_version_has_written_is_known"),
    ),
    "J10": _row(
        "the journal was written by a later version",
        "the gateway does not start, and changes nothing",
        (DISK, "a_journal_of_a_later_version_is_left_alone"),
        (UPGRADE, "a_record_that_has_changed_comes_with_another_version_of_the_tables"),
    ),
    "J11": _row(
        "the disk is full at the first start of a new version",
        "that is said, and the journal is left as it is until a restart",
        (OPENING, "the_first_start_of_a_new_version_on_a_full_disk_says_so_and_changes_nothing"),
    ),
    "J12": _row(
        "the journal belongs to another user",
        "that is said; where it can be read it is waited for",
        (DISK, "a_file_of_another_user_is_told_as_such_and_waited_for"),
        (OPENING, "one_that_may_not_be_read_is_told_and_left_as_it_is"),
    ),
    "J13": _row(
        "the journal is so large that it takes minutes to look it over",
        "the log says so and the service manager waits",
        (SERVER, "a_journal_that_takes_long_is_told_before_it_is_looked_over"),
    ),
}
"""S: the serial line. L: the link master. C: a controller. H: a robot and its dual-port RAM. G: the process
and its computer. A: HTTP and WebSockets. J: the disk and the journal."""

SIZES: Final = {"S": 30, "L": 13, "C": 20, "H": 17, "G": 12, "A": 19, "J": 13}
"""Number of faults in each part."""
