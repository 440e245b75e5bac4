"""Each test that needs ../shared, and the test of the same thing that the repository can run alone.

Files are below tests/; a twin without a file stands beside its test.  `test_left_out.py` checks it.
"""

TWINS = {
    "bim/test_fenestration_ifc.py": {
        "test_real_bsdf_files_come_back_bit_for_bit": "test_klems_tree_g_and_u_come_back_bit_for_bit"
    },
    "bim/test_linked.py": {
        "test_a_real_building_cut_in_three_is_the_whole": "test_a_building_cut_in_three_is_the_whole"
    },
    "bim/test_radiance_folder.py": {
        "test_the_folder_of_a_real_room_gives_our_light": "test_the_folder_gives_our_light"
    },
    "bim/test_real_files.py": {
        "test_rooms_are_closed_and_have_their_stated_size": "bim/test_read_ifc.py::test_sound_room",
        "test_true_north_of_the_fzk_house": "bim/test_read_ifc.py::test_true_north_turns_the_south_window",
        "test_every_file_is_read_or_refused_in_one_line": "bim/test_read_ifc.py::test_what_is_no_ifc_is_refused_in_one_line",
        "test_exported_rooms_are_dark_but_for_their_windows": "bim/test_to_radiance.py::test_room_is_dark_but_for_its_windows",
        "test_energyplus_runs_real_rooms": "bim/test_exports.py::test_energyplus_runs_the_exported_room",
    },
    "bim/test_surroundings_files.py": {
        "test_a_quarter_around_a_real_house": "test_a_quarter_stands_where_the_map_conversion_says"
    },
    "bsdf/test_angular.py": {
        "test_a_pane_of_the_igsdb_is_windows_at_every_angle": "test_glass_passes_fresnels_shares_and_absorbs_along_its_way"
    },
    "bsdf/test_command.py": {
        "test_info_lists_bands_and_angles": "test_info_of_an_even_sheet",
        "test_check_forbids_a_file_that_gains_energy": "bsdf/test_too_much.py::test_a_hemisphere_above_one_or_a_direction_far_above_is_refused",
        "test_check_sees_front_and_back_that_do_not_fit": "test_check_finds_what_is_planted",
    },
    "bsdf/test_en410.py": {
        "test_clear_float_glass_is_as_known": "test_a_grey_pane_has_its_value_everywhere",
        "test_visible_values_are_those_of_window": "test_colour_rendering_is_that_of_colour_science",
        "test_solar_values_are_those_of_windows_table": "test_each_band_looks_at_its_wavelengths",
    },
    "bsdf/test_generate.py": {"test_flat_diffuse_slats_are_those_of_window": "test_blind_is_that_of_genbsdf"},
    "bsdf/test_klems.py": {
        "test_dummy_back_is_the_front_reversed_as_in_radiance": "test_unlike_bases_and_odd_counts_can_be_reversed"
    },
    "bsdf/test_layers.py": {
        "test_a_double_glazing_is_that_of_windows_engine": "test_a_glazing_unit_keeps_its_values_and_energy"
    },
    "bsdf/test_optical_data.py": {
        "test_a_pane_is_that_of_the_igsdbs_own_file": "test_the_command_rates_it_as_the_same_pane_of_optics"
    },
    "bsdf/test_plugin_peak.py": {
        "test_glass_lets_the_view_through_undisturbed": "test_isotropic_glass_lets_the_view_through_undisturbed",
        "test_a_blind_keeps_all_it_lets_through": "bsdf/test_tensor_plugin.py::test_weight_of_rank_4_is_what_is_scattered",
        "test_eval_leaves_the_beam_out": "test_the_peak_of_an_isotropic_tree_is_taken_out_whole",
        "test_peaks_of_a_tree_are_its_straight_leaves": "test_a_peak_of_several_leaves_is_a_beam_of_all_of_them",
        "test_an_isotropic_blind_keeps_all_it_lets_through": "bsdf/test_tensor_plugin.py::test_rank_3_from_the_camera_has_the_right_mean",
        "test_the_sun_and_paths_have_the_beam_and_the_rest_of_a_tree": "test_the_beam_is_that_of_the_side_the_light_comes_from",
    },
    "bsdf/test_screens.py": {
        "test_perforated_sheet_of_windows_engine": "test_a_thin_black_sheet_passes_its_openness_at_every_angle"
    },
    "bsdf/test_shade_file.py": {
        "test_blinds_are_those_of_windows_engine": "bsdf/test_generate.py::test_blind_is_that_of_genbsdf"
    },
    "bsdf/test_spectral_pane.py": {
        "test_both_kinds_of_file_hold_the_same_pane": "bsdf/test_optical_data.py::test_the_command_rates_it_as_the_same_pane_of_optics",
        "test_u_and_shgc_are_those_of_windows_engine": "thermal/test_iso15099.py::test_u_and_temperatures_are_those_of_windows_engine",
    },
    "bsdf/test_tensor_plugin.py": {"test_a_real_file_with_one_transmission": "test_a_single_value_is_a_diffuser"},
    "bsdf/test_tensor_tree.py": {
        "test_values_are_those_of_radiance": "test_random_trees_on_all_sides_are_those_of_radiance"
    },
    "bsdf/test_xml.py": {
        "test_every_real_file_survives_a_round_trip": "test_what_is_written_is_read",
        "test_energy_names_direction_and_amount": "bsdf/test_too_much.py::test_a_hemisphere_above_one_or_a_direction_far_above_is_refused",
    },
    "comply/test_outputs.py": {
        "test_failing_rooms_of_real_buildings_are_found_again": "test_a_failing_room_is_found_again_from_its_topic"
    },
    "glare/test_against_evalglare.py": {"test_real_pictures": "test_pictures"},
    "glare/test_glare_command.py": {"test_band_and_zones_of_radiances_own_test": "test_prints_what_evalglare_prints"},
    "images/test_hdr.py": {
        "test_real_pictures_have_pvalues_pixels": "test_every_orientation_is_set_upright_as_pvalue_does"
    },
    "metrics/test_outdoor.py": {
        "test_median_diffuse_illuminance_of_reykjavik": "metrics/test_metrics.py::test_daylight_hours_are_the_brighter_half"
    },
    "scenes/test_angular_file.py": {
        "test_layers_of_a_glazing_system_are_read": "test_a_unit_has_as_many_panes_as_it_says"
    },
    "scenes/test_case_comfort.py": {
        "test_north_is_comfortable_longest": "thermal/test_comfort.py::test_ashrae_bands_agree_with_pythermalcomfort"
    },
    "scenes/test_energyplus_sun.py": {
        "test_the_studies_read": "scenes/test_study_tutorials.py::test_case_of_the_standard_reads"
    },
    "scenes/test_energyplus_traced.py": {
        "test_shades_outside_meet_their_bars_with_traced_sun": "test_panes_send_light_straight_on_and_shades_to_all_sides",
        "test_glass_meets_its_bar_where_it_passes_the_sky_as_energyplus": "test_each_patch_keeps_its_own_light",
    },
    "scenes/test_run_rooms.py": {
        "test_a_tensor_tree_is_taken_for_its_klems_matrix": "bsdf/test_evaluate.py::test_energy_is_that_of_the_tree"
    },
    "scenes/test_simquality.py": {
        "test_shapes_shade_as_the_suite_says": "scenes/test_sky_seen.py::test_an_overhang_hides_the_sky_from_what_is_below_it",
        "test_sun_of_the_files_stands_where_the_suite_has_it": "sky/test_sun.py::test_spa_is_that_of_its_paper",
        "test_sun_of_the_studies_lies_in_the_bounds_of_the_suite": "thermal/test_climate.py::test_walls_windows_and_frames_see_their_own_share_of_the_sky",
    },
    "scenes/test_study_tutorials.py": {
        "test_cases_of_the_standard_lie_in_the_range_of_its_programs": "thermal/test_vdi6007.py::test_the_norms_results_within_its_tolerance"
    },
    "scenes/test_twin_house.py": {
        "test_study_reads_what_was_measured": "scenes/test_measured_weather.py::test_study_of_two_days_by_half_hours",
        "test_living_room_follows_the_measured_air": "thermal/test_vdi6007.py::test_the_norms_results_within_its_tolerance",
        "test_living_room_behind_shutters_follows_in_every_phase": "thermal/test_energyplus.py::test_clear_glazing_meets_the_bars_in_the_demo_s_climate",
    },
    "scenes/test_window_data.py": {
        "test_layers_absorb_as_windows_engine_has_it": "test_what_layers_absorb_adds_up_and_panes_get_their_part",
        "test_g_by_direction_of_assumed_layers_is_windows_engine_s": "test_assumed_layers_find_another_glazing_by_u_and_g",
        "test_a_panes_file_lies_beside_the_toml": "test_toml_says_panes_gases_and_shade",
    },
    "sky/test_matrix.py": {
        "test_six_climates_are_those_of_gendaymtx": "test_chicago_is_that_of_gendaymtx",
        "test_six_climates_on_fine_patches": "test_years_made_here_are_those_of_gendaymtx",
    },
    "sky/test_weather_table.py": {
        "test_sound_files_are_left_alone": "sky/test_weather.py::test_fog_a_desert_and_a_storm_are_weather",
        "test_every_zone_shows_in_every_file": "test_a_sun_in_the_wrong_place_is_refused",
    },
    "thermal/test_ashrae140.py": {
        "test_basic_cases_lie_in_the_range": "thermal/test_vdi6007.py::test_the_norms_results_within_its_tolerance",
        "test_all_cases_lie_in_the_range": "thermal/test_vdi6007.py::test_the_norms_results_within_its_tolerance",
        "test_traced_sun_by_its_parts_is_energyplus_own": "scenes/test_energyplus_traced.py::test_each_patch_keeps_its_own_light",
    },
    "thermal/test_energyplus.py": {
        name: "test_clear_glazing_meets_the_bars_in_the_demo_s_climate"
        for name in (
            "test_sun_on_the_facade_is_energyplus_own",
            "test_better_closure_meets_the_bars_in_one_climate",
            "test_gap_closure_meets_the_bars_of_glazing_with_what_anyone_knows",
            "test_our_own_layers_meet_the_bars_of_glass_blind_and_interior_shade",
            "test_plain_kuhn_shows_the_dissertation_s_errors",
            "test_better_closure_meets_the_bars_in_all_cases",
            "test_energyplus_run_here_and_now_is_the_reference",
        )
    }
    | {
        "test_comfort_agrees": "thermal/test_comfort.py::test_ashrae_bands_agree_with_pythermalcomfort",
        "test_heating_and_cooling_agree": "thermal/test_vdi6007.py::test_the_norms_results_within_its_tolerance",
    },
    "thermal/test_iso15099.py": {
        "test_longwave_of_blinds_and_fabrics_is_that_of_windows_engine": "test_slats_pass_the_view_factor_of_their_openings"
    },
    "thermal/test_window_reference.py": {
        "test_the_generator_writes_what_others_computed": "test_the_stored_files_are_what_the_generator_writes"
    },
    "trace/test_cie171.py": {
        "test_the_reports_figures_are_those_of_the_quadrature": "test_a_few_points_behind_glass_have_the_sky_that_they_see",
        "test_past_the_wall_the_reports_figures_are_those_of_the_quadrature": "test_a_wall_outdoors_has_the_light_that_the_facade_leaves_it",
    },
}
