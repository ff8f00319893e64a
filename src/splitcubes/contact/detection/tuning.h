#pragma once

#include <cstddef>
#include <cstdint>

/// Tuning constants of contact search and rigid fragments: tolerances, shares, limits and iteration counts
/// that decide about behaviour, accuracy or time, grouped by subject. Each comment gives the unit (none for
/// pure numbers; spacings: mean distances of phyxels), the sensible range and the effect of larger and
/// smaller values.

namespace splitcubes::body::tuning {

/// Change counters of a surface (surface_changes.cpp), and influences of its vertices (body_view.cpp).
namespace set_up {

/// Grid cells per side of a cube that records changes of the surface, from 1. Larger ones report more false
/// changes; smaller ones take memory.
inline constexpr double cells_per_change_cube = 1;
/// Maximum number of these cubes: limits memory to 8 MiB per body.
inline constexpr double max_change_cubes = 1 << 21;
/// Share of a cube's side by which queried and marked boxes grow, 1e-9 to 0.01: covers the callers' rounding
/// errors.
inline constexpr double change_cube_margin = 1e-6;
/// Doublings of the radius, from 1.5 spacings, in the search for the nearest phyxel of a piece; then all
/// phyxels are compared. Affects time only.
inline constexpr int max_radius_doublings = 4;

}  // namespace set_up

/// Samples of the surface that may touch (surface_sampler.cpp, contact_sides.cpp, sample_grid.cpp).
namespace samples {

/// Dot product of normals, 0.9 to 1, above which the samples in a box of a spacing belong to one flat face,
/// of which one pushes. Larger makes more samples push on curved surfaces, which costs time; smaller rounds
/// edges off.
inline constexpr float flat_face_cosine = 0.998F;
/// Spacings, maximum size of such a box, 0.5 to 2; boxes are whole cells. Larger has fewer pushing samples.
inline constexpr double max_box_share = 1.15;
/// Dot product of normals above which two samples of cut faces in a box belong to one face, 0 to 1. Larger
/// keeps more samples of rough faces.
inline constexpr float one_cut_face_cosine = 0.7F;
/// Preferred position of the pushing sample of a flat face in its box, as a share of the box: of faces that
/// look along an axis. It differs from preferred_against so that the samples of the two faces of a cut do not
/// coincide.
inline constexpr float preferred_along = 0.2F;
/// The same for faces that look against the axis.
inline constexpr float preferred_against = 0.8F;
/// Spacings squared, 1e-4 to 0.05: variance of a side's phyxels along an axis below which motion is hardly
/// extrapolated along it. Larger reproduces less of the rotation; smaller gives larger weights.
inline constexpr double min_spread = 0.005;
/// Share of the total weight below which a phyxel of a blended side is dropped, 0 to 1e-3. Larger makes
/// forces jump as phyxels drop out.
inline constexpr double min_weight_share = 1e-6;
/// Share of the minimum reach that cells of the grid cover as extra reach of slow points, 0 to 0.2. Larger
/// makes larger cells; points beyond it search more cells. Affects time, and sums in the last bits.
inline constexpr double slow_reach_share = 0.04;
/// Division of each side of the cube of directions, along both of its axes, 0 to 1. The middle part
/// covers 11.2 degrees about an axis: surfaces at right angles to each other, as of boxes, do not face each
/// other then. Affects time only.
inline constexpr double direction_bin_edge = 0.14;

}  // namespace samples

/// Contact between surfaces (surface_contacts.cpp; docs/contact.md, docs/algorithms/contact-search.md,
/// decision 003). Lengths in spacings.
namespace contacts {

/// Gap predicted for the end of the step below which a contact is listed, 0.01 to 0.2. Smaller misses
/// contacts of stiff splinters: 0.03 was not enough; larger lists contacts that never push (decision 003).
inline constexpr double speculative_share = 0.05;
/// Maximum overlap that is believed, 0.5 to 2. Larger finds partners on the far side of thin parts; smaller
/// loses deep overlaps.
inline constexpr double max_overlap_share = 1;
/// Maximum tangential distance to the partner sample, 0.5 to 1.5. Larger lets samples push beyond the edge of
/// a face; smaller leaves gaps between samples.
inline constexpr double max_tangential_share = 0.9;
/// Maximum depenetration per step, 0 to 0.1. Larger removes overlaps sooner and adds more energy.
inline constexpr double depenetration_share = 0.02;
/// Search radius without displacements, 1 to 2. Larger costs time; smaller leaves fewer samples for the mean
/// plane.
inline constexpr double reach_share = 1.25;
/// Maximum search radius with displacements, above reach_share. Larger costs time; smaller misses fast
/// bodies.
inline constexpr double max_reach_share = 3;
/// Free fall in one step beyond which the speculative distance is widened by the rest, 0 to 0.5. Bodies that
/// begin to fall may overlap by this much before they are found; smaller lists more contacts.
inline constexpr double free_fall_allowance = 0.15;
/// Radius of the first, cheap search, below reach_share. Larger makes it cost more; smaller repeats more
/// searches.
inline constexpr double first_reach_share = 0.95;
/// Extra distance over which a face is followed beyond the nearest sample, 0.25 to 1. Larger averages over
/// bends; smaller makes gaps jump from sample to sample.
inline constexpr double face_reach_share = 0.75;
/// Samples farther behind the plane than the partner by this much, 0 to 0.5, are checked for separation by a
/// cut themselves. Larger takes samples on the far side of thin walls (decision 003, option 6); smaller costs
/// checks.
inline constexpr double behind_share = 0.1;
/// Distance below which one of two opposite samples of a cut cell searches for both, 0 to 1. Larger drops
/// contacts, smaller finds them twice.
inline constexpr double opposite_share = 0.5;
/// Dot product of normals, -1 to facing_cosine (sample_grid.h), below which surfaces are opposite. Larger
/// ends searches at oblique partners; smaller searches farther than needed.
inline constexpr double opposite_cosine = -0.8;
/// Dot product of normals, 0 to 1, above which samples belong to one face. Larger averages over fewer
/// samples, smaller over bends.
inline constexpr double one_face_cosine = 0.8;
/// Cells, 0 to 1: depth of the points below the surface between which separation by a cut is tested. Larger
/// crosses thin parts; smaller meets the roughness of cut faces.
inline constexpr double depth_below_surface = 0.6;
/// Distance at rest beyond which two points of one piece may meet without a cut between them, 2 to 10.
/// Smaller lets neighbours on a bend push each other; larger lets thin parts fold through each other.
inline constexpr double far_at_rest = 4;
/// Speculative distance to colliders, beyond the displacement by speed, 0.01 to 0.2. Larger lists contacts
/// that never push; smaller finds some a step late.
inline constexpr double collider_speculative_share = 0.05;
/// Maximum depenetration per step out of colliders, 0 to 0.1. The springs undo a quarter of it
/// (contact/response, contact::depenetration_share).
inline constexpr double collider_depenetration_share = 0.02;
/// Cells, 0.02 to 0.3: how much nearer than the samples around it a vertex must be to a collider to touch it
/// by itself. Larger lets rims sink in; smaller has more contacts.
inline constexpr double vertex_tolerance = 0.1;
/// Distance of a point that touches a collider from its drawn vertex, 0.02 to overlaps::allowed_share. Larger
/// leaves more to the lift of whole pieces; smaller adds energy to bodies that roll, as the forces act on the
/// mean of the influences.
inline constexpr double max_drawn_error_share = 0.04;
/// Maximum distance of a rendered vertex from its influences' mean in the bound of a sample's motion, 0.1 to
/// 1. Smaller may miss contacts of strained material, larger costs time.
inline constexpr double max_vertex_offset_share = 0.5;
/// Bound on the sum of a side's absolute weights, from 1. Larger widens the search; smaller may miss
/// contacts.
inline constexpr double max_weight_sum = 4;

}  // namespace contacts

/// Steps that need no search for contacts (quiet_motion.cpp, contact_finder.cpp). Lengths in spacings. The
/// clearance exceeds what the motion within the other bounds can close, so that a search would find nothing.
namespace quiet {

/// Clearance around each sample beyond the search radius in the remembered state, 0.5 to 2. Larger finds
/// fewer such states.
inline constexpr double clearance_share = 1.5;
/// Dot product of normals below which samples face each other there, from facing_cosine to 0: bounds the
/// rotation of normals against each other. Larger finds fewer states.
inline constexpr double clear_cosine = -0.1;
/// Displacement of a phyxel beyond the rigid motion of its piece, 0.05 to 0.3. Two samples may take twice
/// this, that of max_motion_share and their weights out of the clearance: larger may miss contacts, smaller
/// lasts shorter.
inline constexpr double max_displacement_share = 0.2;
/// The same for the motion in the coming step.
inline constexpr double max_motion_share = 0.2;
/// Displacement beyond which the deformation of the phyxels is compared, too, 0.01 to 0.05: it turns normals.
/// Larger may miss contacts, smaller costs time.
inline constexpr double bending_displacement_share = 0.03;
/// Change of a deformation gradient, 0.05 to 0.15. Two normals turn by twice this, which must stay below what
/// clear_cosine leaves. Larger may miss contacts, smaller lasts shorter.
inline constexpr double max_deformation = 0.12;
/// rad, rotation of a piece in a step, 0.01 to 0.1.
inline constexpr double max_rotation = 0.1;
/// Distance between the bounding boxes of the phyxels of two pieces, from 5: the search radius and what
/// surfaces lie outside their phyxels.
inline constexpr double apart_share = 6;
/// Pieces beyond which steps are searched always, 8 to 1000: all pairs are compared.
inline constexpr std::size_t max_pieces = 64;
/// Steps without contacts after which a state is tested for clearance, 1 to 10; doubled up to max_wait
/// whenever a state did not last. Fewer test in vain; more search in vain.
inline constexpr int first_wait = 2;
/// Its maximum, 16 to 256.
inline constexpr int max_wait = 64;

}  // namespace quiet

/// Contacts of rigid fragments (rigid_contacts.cpp, rigid_contacts_push.cpp; docs/contact.md). Lengths in
/// spacings unless stated; the shares and cosines of the search act as those of contacts.
namespace fragments {

/// Search radius for surfaces.
inline constexpr double reach_share = 1.25;
/// Maximum overlap that is believed.
inline constexpr double max_overlap_share = 1;
/// Maximum tangential distance of a point from a sample.
inline constexpr double max_tangential_share = 0.9;
/// Speculative distance.
inline constexpr double speculative_share = 0.05;
/// Depenetration per step of an overlap that existed before, 0 to 0.05. Larger removes overlaps sooner,
/// visibly jumping.
inline constexpr double depenetration_share = 0.005;
/// Share of the depth of such an overlap, 0 to 1, that is removed in addition per step; same effect.
inline constexpr double depth_share = 0.1;
/// Spacings per second, 0.05 to 0.5: depenetration that is paid for with relative motion where there is any.
/// Larger lifts what rests; smaller lets fragments sink into soft surfaces.
inline constexpr double resting_rate = 0.1;
/// Share of the energy that impulses and corrections took, 0 to 1, that reducing overlaps may cost. Larger
/// turns hits of heaps into their expansion; smaller keeps overlaps longer.
inline constexpr double lifting_share = 0.1;
/// Limit of the believed displacement of a surface or fragment per step, 0.5 to 10. Bounds the search: larger
/// costs time, smaller misses fast ones.
inline constexpr double max_displacement_share = 2;
/// Gap of two fragments after the step, 0.2 to 2, beyond which corrections of overlaps do not bring them
/// together. Larger costs time and memory where heaps hit; smaller misses overlaps for a step.
inline constexpr double max_end_gap_share = 0.5;
/// Dot product of normals above which samples belong to one face.
inline constexpr double one_face_cosine = 0.8;
/// Extra distance over which a face is followed beyond the nearest sample.
inline constexpr double face_reach_share = 0.75;
/// m, clamp for the positions that the grid of balls can take.
inline constexpr double max_grid_coordinate = 1e90;
/// Share of the maximum depenetration below which a penetration counts as rounding, 1e-6 to 0.1. Larger
/// leaves overlaps, smaller iterates on noise.
inline constexpr double negligible_share = 1e-3;
/// Distance below which obstacles and neighbours support a fragment that is pushed, 0 to 0.1. Larger lets
/// fragments rest on what they do not touch; smaller lets heaps sink.
inline constexpr double support_share = 0.02;
/// Maximum number of position iterations, 5 to 100: accuracy of deep heaps against time.
inline constexpr int max_position_iterations = 30;
/// Maximum number of velocity iterations, 20 to 1000; the same trade.
inline constexpr int max_velocity_iterations = 200;
/// Share of the fastest approach, 1e-5 to 0.01: smaller changes of velocity end the iterations.
inline constexpr double converged_share = 1e-3;
/// Share of the other changes, 0.1 to 1, that those at contacts with elastic pieces exceed where iterations
/// stagnate, as where surfaces close on a fragment from two sides. Larger iterates longer in vain; smaller
/// gives up heaps that lie on soft pieces.
inline constexpr double stagnation_share = 0.3;
/// Iterations stagnate if stagnation_check_interval of them leave more than this share of the changes, 0 to
/// 1. Larger iterates longer in vain, smaller gives up early.
inline constexpr double stagnation_ratio = 0.8;
/// Iterations between checks for stagnation, 2 to 50.
inline constexpr int stagnation_check_interval = 10;
/// Share of the velocity that is missing to a hit, 0.9 to 1 - 1e-9, by which it may change before the contact
/// is solved again. Smaller solves more of them, larger may skip one by rounding.
inline constexpr double unchanged_share = 1 - 1e-6;
/// Bound of the change of a signed distance over the way, 1.74 to 3: sampled shapes reach sqrt(3). Larger
/// tests more fragments against colliders, smaller misses some.
inline constexpr double max_distance_slope = 2;
/// Share of the extent of all balls, 2e-7 to 1e-4, that their radii grow by in single precision. Larger lists
/// more of them in vain, smaller misses some.
inline constexpr double ball_rounding = 1e-6;

}  // namespace fragments

/// Overlaps of drawn surfaces with colliders at the end of a step (collider_overlaps.cpp). Lengths in
/// spacings.
namespace overlaps {

/// Depth, 0.04 to 0.1, at which vertices are drawn that lie deeper, and from which rigid pieces are lifted.
/// Larger lets these sink in where contact forces fail; smaller takes their place.
inline constexpr double allowed_share = 0.048;
/// Depth up to which a vertex of a rigid piece that a cut made or moved stays in a collider, 0.1 to 0.5.
/// Larger hides more of what is in there; smaller lifts pieces for nothing that moved, which adds energy.
inline constexpr double max_kept_share = 0.4;
/// Depth of a vertex of an elastic piece in a collider, 0.4 to 1.5, from which the phyxels of the piece are
/// looked at. Cuts leave vertices that deep, and flaps swing on phyxels that are outside. Larger lets phyxels
/// stay; smaller costs time.
inline constexpr double max_elastic_share = 1;
/// Depth up to which a phyxel of an elastic piece stays in a collider, 0.5 to 1.5; the same trade. Contact
/// forces hold it there, which in material that its own weight crushes sinks by half a spacing.
inline constexpr double max_centre_share = 1;
/// Depth up to which a vertex of a piece that is held is drawn elsewhere than its motion takes it, above
/// max_elastic_share, to 2. Larger hides pieces that are held in a collider; smaller draws them inside.
inline constexpr double max_drawn_share = 1.5;
/// Distance from a collider up to which the vertices of a piece are looked at, 0.5 to 2. Smaller may lift a
/// piece into another collider.
inline constexpr double near_share = 1;
/// Lift that is left out, 1e-4 to 0.01.
inline constexpr double negligible_share = 1e-3;
/// Maximum number of rounds over the colliders, 2 to 20. More serve pieces in corners between several.
inline constexpr int max_lifts = 8;
/// Iterations over the vertices that are stopped, 5 to 50: accuracy of impulses against time.
inline constexpr int iterations = 20;

}  // namespace overlaps

/// Pieces that rotate together (piece_turns.cpp).
namespace turns {

/// Rotation in a step, rad, 0.15 to 0.5, from which the angular velocity at its start does not say how pieces
/// rotate. Larger drives small pieces that tumble; smaller lets pieces that rotate together slide.
inline constexpr double max_angle = 0.25;

}  // namespace turns

/// Hits that rebound (restitution.cpp).
namespace restitution {

/// Steps of free fall, 1 to 5: hits that are slower than what gravity does in them have no rebound. More end
/// a series of bounces sooner; fewer keep resting bodies in motion.
inline constexpr double resting_steps = 2;
/// Spacings per step, 1e-5 to 0.01: slower hits have no rebound, with or without gravity.
inline constexpr double resting_share = 1e-3;
/// Share of the approach speed, 0 to 0.1, below which the sides no longer approach. Larger cuts the approach
/// short; smaller waits for what the solve leaves.
inline constexpr double turned_share = 0.02;
/// Share of the approach speed, turned_share to 0.5, with which sides may still approach when their contacts
/// end, so that they rebound. Larger throws back what slides off an edge; smaller misses hits of stiff bodies
/// of which a solve leaves a rest.
inline constexpr double stopped_share = 0.25;
/// Share of the approach speed, 0 to 0.01, by which the speed of parting grows in a step while strain pushes.
/// Larger gives the impulse while it still does; smaller waits where it hardly does.
inline constexpr double rising_share = 0.002;
/// Share of the energy of the rebound, or of what is in excess of it, 0 to 0.5. Where the strain has less,
/// the impulse is given at once. Larger ends hits sooner than their strain does; smaller lets stiff bodies
/// stay, or rise, for another step.
inline constexpr double weak_share = 0.1;
/// Spacings, 0 to 2: offset of a hit on a collider from the centre of mass that counts as none. Contacts are
/// about a spacing apart. Larger leaves hits off the centre without spin; smaller turns what a solve leaves
/// into spin.
inline constexpr double blur_share = 1;
/// Share of the wanted speed, 0.1 to 0.9, below which an impulse had too little energy.
inline constexpr double moving_share = 0.5;
/// Steps, 1 to 10, that a hit stays without anything that pushes its sides apart. More wait for energy that
/// contact springs release late; fewer end the hits of resting bodies sooner.
inline constexpr std::uint32_t stalled_steps = 3;
/// Relative change of a mass, 1e-12 to 1e-3, above which the piece is another one.
inline constexpr double same_mass_share = 1e-9;

}  // namespace restitution

}  // namespace splitcubes::body::tuning
