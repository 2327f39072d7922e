"""Every refusal, time-out, lost link, reboot and override of the protocols, and the test that stands for it.

All of them run in virtual time but those of MAVSDK, whose library keeps its own clock.
"""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

HERE = Path(__file__).parent

COVERED: dict[str, tuple[str, ...]] = {
    # AR.Drone: commands and sequence numbers
    "a command number not above the last is dropped; 1 resets": (
        "ardrone/test_ardrone_emulator.py::test_only_larger_numbers_are_obeyed_and_one_starts_afresh",
        "ardrone/test_ardrone_at.py::test_the_first_command_is_number_one_and_the_counter_only_grows",
    ),
    "a second client ran ahead with its numbers": (
        "ardrone/test_ardrone_link.py::test_a_second_client_that_ran_ahead_is_overcome_by_starting_at_one",
    ),
    "a restarted client is obeyed at once": (
        "ardrone/test_ardrone_link.py::test_an_adapter_that_starts_anew_is_obeyed_at_once",
    ),
    "no command for 50 ms: bit 30": (
        "ardrone/test_ardrone_emulator.py::test_the_watchdogs_rise_after_50_ms_and_two_seconds",
        "test_refusals.py::test_the_ardrones_command_watchdog_is_reset_at_once",
    ),
    "no command for 2 s: link lost, numbers reset, lands by itself": (
        "ardrone/test_ardrone_emulator.py::test_without_commands_it_keeps_the_last_tilt_and_then_lands",
        "ardrone/test_ardrone_link.py::"
        "test_after_a_long_gap_the_drone_stays_down_until_flight_is_demanded_anew",
    ),
    "the last PCMD is held over a gap": (
        "ardrone/test_ardrone_flight.py::test_late_setpoints_turn_into_hover_and_the_drone_brakes",
        "ardrone/test_ardrone_link.py::test_setpoints_stop_at_the_drone_before_a_lost_link_ends",
    ),
    # AR.Drone: take-off, emergency, landing
    "take-off refused in silence (battery)": (
        "ardrone/test_ardrone_flight.py::test_a_weak_battery_refuses_in_silence_and_the_adapter_says_so",
    ),
    "emergency: entered by itself, cleared by an edge of bit 8, comes back": (
        "ardrone/test_ardrone_flight.py::test_an_emergency_in_flight_is_told_and_not_cleared_by_itself",
        "ardrone/test_ardrone_flight.py::test_an_emergency_from_before_is_cleared_when_flight_is_demanded",
        "ardrone/test_ardrone_flight.py::test_a_lasting_fault_is_pressed_again_and_told",
    ),
    "lands by itself": (
        "ardrone/test_ardrone_flight.py::test_a_drone_that_lands_by_itself_is_not_sent_up_again",
    ),
    "another pilot takes over": (
        "ardrone/test_ardrone_flight.py::test_another_pilot_takes_over_unhindered",
        "ardrone/test_ardrone_flight.py::test_hands_off_in_the_air_hovers_once_and_falls_silent",
    ),
    "a daemon that starts beside a flying drone": (
        "ardrone/test_ardrone_flight.py::test_an_adapter_that_starts_beside_a_flying_drone_does_not_land_it",
    ),
    "the sonar is deaf, or hears something else": (
        "ardrone/test_ardrone_flight.py::"
        "test_with_a_deaf_sonar_the_height_is_unknown_and_a_descent_becomes_a_landing",
        "ardrone/test_ardrone_flight.py::test_a_sonar_echo_of_something_else_is_passed_over",
    ),
    # AR.Drone: configuration, navdata, video
    "CONFIG before navdata, lost, or with a stale acknowledge bit": (
        "ardrone/test_ardrone_config.py::test_nothing_is_configured_before_the_first_navdata",
        "ardrone/test_ardrone_config.py::test_lost_config_and_control_datagrams_are_repeated",
        "ardrone/test_ardrone_config.py::test_a_stale_acknowledge_bit_delays_but_does_not_stop",
    ),
    "a key that is not writable, or needs CONFIG_IDS": (
        "ardrone/test_ardrone_config.py::test_setpoints_are_scaled_by_the_limits_which_the_drone_really_has",
        "ardrone/test_ardrone_config.py::test_custom_profiles_need_their_ids_right_before",
    ),
    "no answer on the configuration port": (
        "ardrone/test_ardrone_config.py::test_without_the_configuration_port_everything_is_written_blind",
    ),
    "the drone reboots, or boots late; navdata starts at 1 again": (
        "ardrone/test_ardrone_link.py::test_a_rebooted_drone_is_configured_again_and_flies",
        "ardrone/test_ardrone_link.py::test_the_drone_may_boot_long_after_the_daemon",
        "ardrone/test_ardrone_navdata.py::test_a_rebooted_drone_is_heard_again_after_a_second_of_silence",
        "ardrone/test_ardrone_navdata.py::"
        "test_the_number_is_forgotten_while_the_drone_misses_commands_or_boots",
    ),
    "the computer leaves the network": ("ardrone/test_ardrone_link.py::test_no_network_is_not_the_end",),
    "video: none for a second, P frames first, gaps, damage, too late": (
        "ardrone/test_ardrone_video.py::test_a_silent_stream_is_opened_anew_and_waits_for_a_whole_picture",
        "ardrone/test_ardrone_video.py::test_nothing_is_shown_before_the_first_whole_picture",
        "ardrone/test_ardrone_video.py::test_frames_lost_at_the_drone_are_waited_out",
        "ardrone/test_ardrone_video.py::test_undecodable_data_restarts_at_the_next_whole_picture",
        "ardrone/test_ardrone_video.py::test_of_several_waiting_pictures_only_the_newest_is_shown",
    ),
    "the camera switch cannot be told by size": (
        "ardrone/test_ardrone_video.py::"
        "test_each_picture_goes_to_the_camera_it_shows_and_none_during_the_switch",
    ),
    # MAVLink: commands
    "each COMMAND_ACK result, and none": (
        "test_refusals.py::test_every_answer_but_acceptance_is_told_and_tried_again",
        "mavlink/test_commands.py::test_an_unanswered_command_is_repeated_with_rising_confirmation",
        "mavlink/test_commands.py::test_in_progress_is_waited_for_and_strange_results_are_refusals",
    ),
    "arming refused until the sensors have settled": (
        "mavlink/test_commands.py::test_arming_is_retried_with_the_autopilots_reason_until_it_is_ready",
        "mavlink/test_px4_vehicle.py::test_arming_refusals_carry_px4s_words",
    ),
    "GUIDED without a position": (
        "mavlink/test_ardupilot_vehicle.py::test_guided_flies_a_vehicle_that_knows_its_position_and_no_other",
    ),
    "a mode acknowledged that never comes": (
        "mavlink/test_ardupilot_vehicle.py::test_an_accepted_mode_that_never_shows_is_not_held_for_long",
    ),
    "disarming in the air is refused": (
        "test_vehicle_contract.py::test_disarming_in_the_air_is_refused_and_told",
    ),
    "armed and not taken off: disarmed after 10 s": (
        "test_refusals.py::test_armed_and_never_flown_it_disarms_and_only_a_new_demand_arms_again",
    ),
    "the meaning of thrust unknown, or other than configured": (
        "mavlink/test_ardupilot_vehicle.py::test_before_the_meaning_of_thrust_is_known_it_is_not_flown",
        "mavlink/test_ardupilot_vehicle.py::"
        "test_thrust_that_means_something_else_than_configured_is_not_flown",
    ),
    # MAVLink: setpoints
    "setpoints dropped in silence (mask, norm, target, mode)": (
        "mavlink/test_arducopter_peer.py::test_these_setpoints_are_dropped_in_silence",
        "mavlink/test_arducopter_peer.py::test_setpoints_are_dropped_in_other_modes_and_the_pilot_flies",
        "mavlink/test_ardupilot_vehicle.py::"
        "test_setpoints_carry_unit_quaternions_all_rates_and_the_climb_as_thrust",
    ),
    "GUID_TIMEOUT: level and hold, no landing": (
        "mavlink/test_arducopter_peer.py::test_roll_turns_level_only_after_the_time_out_and_nothing_lands",
        "test_vehicle_contract.py::test_a_lost_link_ends_control_and_its_return_gives_it_back",
    ),
    "OFFBOARD refused without a stream, lost without it": (
        "mavlink/test_px4_peer.py::test_offboard_needs_a_running_stream",
        "mavlink/test_px4_peer.py::test_arming_in_offboard_needs_the_stream_too",
        "mavlink/test_px4_vehicle.py::test_it_streams_before_offboard_and_only_on_demand",
        "mavlink/test_px4_vehicle.py::test_the_idle_stream_carries_no_thrust_and_never_keeps_a_flight_alive",
    ),
    "not landed until the thrust is cut": (
        "mavlink/test_px4_vehicle.py::test_thrust_is_cut_after_touch_down_so_that_it_reports_landed",
    ),
    "a landed state that is late or wrong": (
        "mavlink/test_px4_vehicle.py::"
        "test_a_flight_whose_landed_state_stays_that_of_the_floor_is_not_dropped",
        "mavlink/test_telemetry.py::test_a_landed_state_is_believed_for_a_second",
    ),
    # MAVLink: who flies
    "the pilot, a failsafe or a ground station changes the mode": (
        "test_vehicle_contract.py::test_the_pilot_wins_within_a_tenth_of_a_second_and_for_good",
        "mavlink/test_ardupilot_vehicle.py::test_a_failsafe_of_the_autopilot_counts_as_a_take_over",
        "mavlink/test_px4_vehicle.py::test_the_failsafe_of_a_lost_link_is_a_take_over",
        "mavlink/test_ardupilot_vehicle.py::test_no_retry_follows_when_the_pilot_takes_over_meanwhile",
    ),
    "the pilot's disarm switch": ("test_refusals.py::test_the_pilots_disarm_switch_is_final",),
    "the ground station's failsafe is not ours to feed": (
        "mavlink/test_ardupilot_vehicle.py::test_we_are_an_onboard_computer_and_beat_twenty_times_a_second",
    ),
    # MAVLink: link, reboots, clocks
    "the autopilot reboots": (
        "test_refusals.py::test_a_reboot_in_control_is_hands_off",
        "mavlink/test_link_care.py::test_a_rebooted_autopilot_is_heard_again_with_its_new_clock",
    ),
    "the companion reboots, on the ground or in the air": (
        "test_refusals.py::test_a_daemon_that_died_in_the_air_and_comes_back_takes_the_flight_over",
        "test_vehicle_contract.py::test_telemetry_arrives_without_any_demand_and_nothing_is_commanded",
    ),
    "either side boots first": ("mavlink/test_link_care.py::test_either_side_may_start_first",),
    "rates overwritten or denied": (
        "mavlink/test_link_care.py::test_rates_that_a_ground_station_overwrote_are_asked_for_again",
        "mavlink/test_link_care.py::test_a_denied_stream_is_not_asked_for_all_the_time",
    ),
    "the rate of HEARTBEAT is denied: it is asked for one by one": (
        "mavlink/test_px4_vehicle.py::test_a_take_over_is_seen_in_time_though_the_heartbeat_keeps_its_rate",
        "mavlink/test_px4_peer.py::test_its_heartbeat_keeps_its_rate_and_comes_when_it_is_asked_for",
    ),
    "the height above home leaps when home is set at arming": (
        "mavlink/test_px4_vehicle.py::test_a_leap_of_the_height_above_home_at_arming_is_no_climb",
    ),
    "the autopilot's clock runs off, or its 32 bits begin anew": (
        "mavlink/test_clock_rate.py::test_attitudes_keep_their_age_when_the_autopilots_clock_runs_off",
        "mavlink/test_clock_rate.py::"
        "test_attitudes_are_taken_on_when_the_boot_time_begins_anew_after_49_days",
    ),
    "two range finders, one below its minimum, one without a signal": (
        "mavlink/test_telemetry.py::test_of_two_range_finders_the_one_that_measures_on_the_floor_is_flown_by",
        "mavlink/test_telemetry.py::test_standing_lower_than_the_sensor_measures_is_a_height",
        "mavlink/test_telemetry.py::test_a_signal_that_is_none_is_no_height_whatever_is_read",
    ),
    "loss, delay, reordering": (
        "mavlink/test_link_care.py::test_a_poor_radio_is_flown_through",
        "mavlink/test_link_care.py::test_an_overtaken_heartbeat_is_no_take_over",
    ),
    "port taken, line stalled, device gone": (
        "mavlink/test_transport.py::test_a_port_in_use_is_told_in_one_line",
        "mavlink/test_transport.py::test_a_stalled_tcp_line_drops_what_is_new_instead_of_piling_it_up",
        "mavlink/test_transport.py::test_tcp_waits_for_the_other_side_and_comes_back_after_a_loss",
        "mavlink/test_transport.py::test_a_serial_line_is_opened_raw_heard_and_found_again_after_a_loss",
    ),
    "no origin without GPS": (
        "mavlink/test_link_care.py::test_guided_by_our_pose_gets_an_origin_until_it_reports_one",
    ),
    "unsigned, replayed or forged frames; a key given or missing": (
        "mavlink/test_codec.py::test_signed_frames_pass_once_and_unsigned_or_wrongly_signed_ones_do_not",
        "mavlink/test_codec.py::test_a_forged_stamp_from_the_future_does_not_lock_the_sender_out",
        "mavlink/test_signing_setup.py::test_a_key_that_was_given_signs_the_flight_and_locks_others_out",
    ),
    # MAVSDK
    "its repeater flies on after the loop has died": (
        "mavlink/test_mavsdk_vehicle.py::"
        "test_a_tick_that_died_in_the_air_is_not_flown_on_and_px4s_own_failsafe_acts",
        "mavlink/test_mavsdk_vehicle.py::"
        "test_a_loop_that_hangs_sends_nothing_though_the_librarys_threads_live",
    ),
    "ArduCopter's offboard means GUIDED there": (
        "mavlink/test_mavsdk_vehicle.py::test_arducopter_is_refused_with_the_reason",
    ),
}


@pytest.mark.parametrize("fact", COVERED)
def test_what_stands_for_a_fact_is_there(fact: str) -> None:
    for place in COVERED[fact]:
        file, name = place.split("::")
        tree = ast.parse((HERE / file).read_text(encoding="utf-8"))
        assert name in {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}, place
