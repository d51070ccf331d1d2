//! The verification book: what the whole system gives beside closed forms and published figures.
//!
//! A case computes figures and adds them to a [`Figures`], which compares them with rows of `reference.toml`. The quick
//! cases are tests of the suite; `cargo run --release -p tests --bin book` runs all of them, or those whose names contain
//! a word, and writes the table of `VERIFICATION.md`. To add a case, write a function beside its neighbours, its rows into
//! `reference.toml`, and its name into the list below.

#![expect(clippy::disallowed_methods, reason = "closed forms are computed with the platform's functions")]

mod beam;
mod cloud;
mod contact;
mod element;
mod erosion;
mod exposed;
mod fold;
mod form;
mod free;
mod friction;
mod gas;
mod girder;
mod hexahedron;
mod joint;
mod law;
mod load;
mod modes;
mod moving;
mod order;
mod perforation;
mod porous;
mod rigid;
mod ring;
mod shell;
mod soft;
mod solid;
mod spheres;
mod spring;
mod stress;
mod structure;
mod wave;
mod zone;

/// Single elements and what carries them, as the tests of the mechanics have them.
#[path = "../../worker/mechanics/tests/elements/bodies.rs"]
#[expect(dead_code, reason = "those tests use more of it")]
mod bodies;
/// Clouds of boxes, likewise.
#[path = "../../worker/mechanics/tests/contact/clouds.rs"]
#[expect(dead_code, reason = "those tests use more of it")]
mod clouds;
/// Worlds of contact, likewise.
#[path = "../../worker/mechanics/tests/contact/world.rs"]
#[expect(dead_code, reason = "those tests use more of it")]
mod world;

use crate::case::Figures;

/// Calls a macro with every case as `room: case kind;`, kind `quick` or `long`: the one list of the book.
#[macro_export]
macro_rules! each_case_of_the_book {
    ($then:ident) => {
        $then! {
            hexahedron: volumes_and_their_gradients_are_exact quick;
            hexahedron: the_patch_has_one_stress_and_no_force_inside quick;
            hexahedron: moving_and_turning_leave_the_stress_what_it_is quick;
            hexahedron: simple_shear_follows_the_jaumann_rate quick;
            law: uniaxial_strain_yields_hardens_by_volume_and_unloads quick;
            modes: a_free_cube_has_six_strain_modes_and_control_resists_the_twelve_others quick;
            modes: each_hourglass_pattern_is_resisted_without_resultant_and_decays quick;
            modes: time_steps_are_those_of_the_thinnest_way_through quick;
            modes: an_isolated_cube_is_stable_to_its_own_limit_only quick;
            element: mass_is_density_times_volume_and_a_free_body_keeps_its_momentum_for_ten_thousand_cycles quick;
            free: small_free_bodies_do_not_gain_energy quick;
            free: free_bodies_keep_their_energy_for_a_hundred_thousand_cycles long;
            wave: a_bar_on_a_rigid_wall_feels_density_wave_speed_velocity_for_two_passages long;
            wave: of_two_equal_bars_the_first_stops_and_the_second_flies_on quick;
            wave: a_short_bar_stops_on_a_long_one_that_flies_on_slower quick;
            wave: a_free_end_doubles_the_velocity_and_turns_the_stress quick;
            wave: a_pulse_at_a_joint_of_two_materials_is_split_by_their_impedances quick;
            wave: a_pulse_at_a_tied_joint_is_split_as_at_a_joined_one quick;
            wave: a_tied_end_flies_off_with_what_it_traps_of_a_pulse quick;
            wave: a_tie_breaks_in_shear_at_the_stress_of_the_wave quick;
            wave: a_bar_that_hardens_linearly_has_an_elastic_and_a_plastic_front quick;
            wave: bars_of_forty_cells_ring_at_their_frequencies quick;
            wave: short_waves_are_slow_by_what_central_differences_say quick;
            wave: symmetric_impacts_reach_the_hugoniot quick;
            wave: symmetric_impacts_at_six_kilometres_a_second_reach_tillotsons_hugoniot quick;
            wave: impacts_of_two_materials_match_their_impedances quick;
            wave: an_elastic_precursor_of_the_elastic_limit_runs_ahead_at_the_longitudinal_speed quick;
            gas: sods_tube_has_its_plateaus_and_its_shock_in_place quick;
            gas: gas_that_runs_together_is_compressed_as_noh_says long;
            gas: the_blast_of_lulesh_reaches_sedovs_radius quick;
            gas: a_point_blast_has_sedovs_radius_at_two_times long;
            order: shocks_converge_with_the_cells quick;
            order: elastic_waves_and_bent_shells_converge_with_the_square_of_the_cells quick;
            order: taylor_bars_and_blasts_converge_with_the_cells long;
            law: a_ceramic_breaks_and_bulks_as_johnson_and_holmquist_say quick;
            porous: shocks_in_a_porous_metal_leave_the_states_of_its_hugoniot quick;
            porous: a_foam_that_strikes_a_wall_presses_as_reid_and_peng_say quick;
            law: products_have_their_chapman_jouguet_state_and_follow_its_isentrope quick;
            law: a_detonation_runs_at_its_speed_with_its_pressure_behind quick;
            law: detonations_at_default_settings_reach_the_state_of_chapman_and_jouguet quick;
            law: a_shock_heats_by_the_energy_above_the_cold_curve quick;
            law: johnson_cook_has_its_point_values_in_an_element quick;
            solid: the_copper_bar_is_as_long_and_its_foot_as_wide_as_others_find quick;
            solid: finer_copper_bars_come_nearer_to_what_others_converge_to long;
            solid: the_copper_bar_of_tetrahedra_ends_as_that_of_hexahedra_of_their_spacing quick;
            solid: the_johnson_cook_bar_ends_as_a_code_of_the_same_mesh_finds quick;
            solid: a_soft_sphere_bounces_off_a_wall_as_hertz_says long;
            solid: steel_spheres_bounce_off_a_wall_as_hertz_says long;
            solid: two_steel_spheres_bounce_off_each_other_as_hertz_says long;
            solid: a_rigid_wall_gives_its_impulse_along_its_normal_and_coulombs_share_beside_it quick;
            structure: the_impulsive_panel_is_dented_as_deep_as_measured long;
            structure: the_impulsive_beam_bends_as_a_code_of_the_same_elements_finds long;
            structure: a_beam_thrown_all_over_is_bent_about_as_a_rigid_plastic_one quick;
            structure: a_cantilever_of_one_point_elements_rings_at_its_reduced_bending_stiffness long;
            structure: a_cantilever_of_assumed_strains_rings_as_a_beam_with_one_layer quick;
            structure: a_cantilever_of_eight_points_is_hardly_softer_than_a_beam long;
            structure: a_cantilever_of_composite_tetrahedra_rings_as_a_beam quick;
            form: a_cantilever_of_wedges_rings_as_a_beam_with_one_layer quick;
            form: a_struck_bar_of_each_form_shortens_as_one_of_hexahedra quick;
            spheres: a_ball_keeps_its_motion_for_ten_bounces long;
            spheres: spheres_that_meet_off_centre_part_along_the_line_of_centres long;
            structure: higher_tones_of_a_cantilever_are_those_of_timoshenko_with_that_stiffness long;
            shell: the_twisted_beam_bends_as_published quick;
            shell: the_roof_sags_as_published quick;
            shell: the_cylinder_is_pinched_as_published quick;
            shell: the_hemisphere_opens_as_published long;
            shell: a_cantilever_of_shells_bends_as_a_beam quick;
            shell: a_tapered_cantilever_of_shells_bends_as_a_beam quick;
            beam: a_cantilever_of_beams_bends_as_timoshenko_says quick;
            beam: a_cantilever_of_beams_rings_as_timoshenko_says quick;
            beam: a_pressed_column_loses_its_stiffness_at_eulers_load quick;
            beam: a_cantilever_of_beams_turns_in_a_plastic_hinge quick;
            beam: a_free_frame_that_turns_keeps_its_energy quick;
            spring: a_mass_on_a_spring_swings_as_the_closed_form_says quick;
            spring: a_damper_takes_the_energy_of_a_mass_as_the_closed_form_says quick;
            spring: an_elastoplastic_spring_keeps_the_area_of_its_loop quick;
            spring: a_spring_of_points_stops_a_mass_as_its_energy_says quick;
            spring: a_mass_that_falls_into_a_slack_cable_stretches_it_as_its_energy_says quick;
            shell: a_square_plate_sags_under_pressure quick;
            shell: a_strip_of_shells_rings_as_a_beam quick;
            shell: a_square_plate_rings_at_its_frequencies quick;
            shell: the_impulsive_panel_of_shells_is_dented_about_as_deep quick;
            shell: a_square_tube_folds_at_its_mean_crush_force long;
            shell: a_tube_that_feels_the_rate_folds_at_a_greater_force long;
            shell: a_tube_that_is_crushed_to_a_block_passes_nowhere_through_itself long;
            shell: a_hexagonal_tube_folds_at_its_mean_crush_force long;
            shell: a_thin_tube_that_was_tested_folds_at_its_mean_crush_force long;
            shell: a_wide_tube_that_was_tested_folds_at_its_mean_crush_force long;
            shell: the_girder_folds_without_passing_through_itself long;
            fold: arms_of_a_strip_that_are_thrown_together_stay_apart quick;
            girder: a_girder_alone_gives_the_wall_its_momentum_and_stays_symmetric_throughout quick;
            load: a_pressure_by_curve_drives_a_wave_of_its_shape quick;
            load: a_velocity_by_curve_arrives_as_it_was_prescribed quick;
            moving: a_jet_gives_a_plate_the_impulse_of_its_way quick;
            moving: a_load_that_crosses_a_beam_bends_it_as_timoshenko_says quick;
            load: blasts_have_the_peaks_of_another_published_fit_at_twenty_distances quick;
            load: a_transmitting_face_lets_a_pulse_out quick;
            load: shear_waves_leave_through_a_transmitting_face_too quick;
            load: a_force_by_curve_gives_its_impulse_and_gravity_its_fall quick;
            load: a_hanging_bar_relaxes_to_its_length_under_its_weight quick;
            load: a_wall_of_finite_mass_is_slowed_by_the_bar_it_strikes quick;
            load: what_bodies_lose_a_wall_of_finite_mass_has quick;
            load: a_driven_wall_pushes_as_a_bar_that_strikes_it_is_pushed quick;
            load: a_wall_gives_the_impulse_that_bodies_lack_and_rubs_after_coulomb quick;
            load: a_body_between_a_sphere_and_a_cylinder_stays_outside_both quick;
            stress: a_pulled_bar_that_is_let_go_unloads_by_a_wave quick;
            stress: plates_in_equilibrium_stay_as_they_are quick;
            stress: pulled_bars_that_are_held_stay_as_they_are quick;
            stress: a_bent_strip_springs_back quick;
            stress: plastic_strain_at_the_start_has_hardened quick;
            erosion: an_element_that_leaves_a_block_uncovers_its_neighbours quick;
            erosion: a_rod_goes_through_a_plate_and_energies_add_up long;
            erosion: a_torn_sheet_closes_its_account_of_energy quick;
            erosion: a_punch_of_a_keyword_deck_goes_through_and_what_is_dropped_is_booked quick;
            ring: a_ring_breaks_into_as_many_pieces_as_mott_says quick;
            ring: a_wound_ring_breathes_by_the_modulus_round_it quick;
            exposed: a_ball_goes_through_a_plate_at_any_speed_and_gap long;
            soft: a_steel_block_thrown_on_foam_rubber_and_water_stays_outside quick;
            friction: a_block_on_an_incline_rests_or_slides_after_coulomb long;
            perforation: a_blunt_projectile_goes_through_steel_from_the_measured_velocity_on long;
            cloud: a_sphere_at_six_kilometres_a_second_leaves_a_hole_with_lips_and_a_cloud long;
            perforation: a_fragment_of_tetrahedra_keeps_of_its_velocity_what_thor_leaves_it long;
            perforation: an_ogive_keeps_of_its_velocity_what_it_kept_behind_a_slab_of_concrete long;
            rigid: a_free_top_precesses_after_euler quick;
            rigid: a_rigid_ball_that_strikes_a_block_keeps_both_momenta quick;
            rigid: a_rigid_mass_on_the_end_of_a_bar_slows_down_after_saint_venant quick;
            joint: a_double_pendulum_follows_lagranges_equations quick;
            joint: a_rod_on_a_hinge_is_struck_at_and_off_its_centre_of_percussion quick;
            zone: points_about_a_face_have_their_region_distance_and_weights quick;
            zone: a_node_swept_over_joints_feels_one_steady_force quick;
            zone: every_pair_keeps_force_and_moment quick;
            zone: a_bounce_keeps_its_energy_as_central_differences_allow quick;
            zone: no_node_shot_at_a_faceted_body_gets_in quick;
            zone: the_sort_of_a_cloud_finds_what_brute_force_finds long;
            contact: eight_bodies_that_hit_each_other_keep_both_momenta quick;
            contact: a_debris_box_of_ten_bodies_keeps_both_momenta_and_its_energy quick;
            contact: a_debris_box_of_fifty_bodies_keeps_both_momenta_and_its_energy long;
            contact: struck_plates_conserve_keep_apart_and_move_together quick;
            contact: strengthless_plates_reach_the_impedance_match_on_the_axis quick;
            contact: no_node_of_a_body_thrown_at_another_ends_inside_it quick;
            contact: bodies_that_close_in_from_both_sides_are_sorted_in_time quick;
            contact: meshes_of_three_and_five_faces_press_on_each_other_evenly quick;
            contact: a_cube_stacked_at_45_degrees_is_stopped_by_the_zones_of_edges_if_the_gap_reaches_them quick;
            contact: a_cube_stacked_at_45_degrees_is_stopped_by_its_edges quick;
            contact: ridges_that_meet_at_right_angles_do_not_pass_through_each_other quick;
        }
    };
}

/// A case of the book.
#[derive(Clone, Copy)]
pub struct Entry {
    /// `room: what it claims`.
    pub name: &'static str,
    /// Short enough for every run of the tests.
    pub quick: bool,
    compute: fn(&mut Figures),
}

impl Entry {
    /// Computes its figures.
    ///
    /// # Panics
    /// If the case has no figures: its run failed, or what must be was not.
    pub fn run(&self) -> Figures {
        let mut figures = Figures::default();
        (self.compute)(&mut figures);
        figures
    }
}

macro_rules! entries {
    ($($room:ident: $case:ident $kind:ident;)*) => {
        &[$(Entry {
            name: concat!(stringify!($room), ": ", stringify!($case)),
            quick: matches!(stringify!($kind).as_bytes(), b"quick"),
            compute: $room::$case,
        }),*]
    };
}

/// All cases, in the order of the book.
pub const ENTRIES: &[Entry] = each_case_of_the_book!(entries);

/// Runs one case and fails with every figure that missed.
///
/// # Panics
/// If a figure missed, or there is no such case.
pub fn check(name: &str) {
    let entry = ENTRIES.iter().find(|entry| entry.name == name);
    entry.unwrap_or_else(|| panic!("the book has no case \"{name}\"")).run().close();
}
