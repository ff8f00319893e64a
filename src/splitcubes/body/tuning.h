#pragma once

/// Tuning constants of bodies, contact search, rigid fragments and tearing: tolerances, shares, limits and
/// iteration counts that decide about behaviour, accuracy or time, grouped by subject. Each comment gives the
/// unit (none for pure numbers; spacings: mean distances of phyxels), the sensible range and the effect of
/// larger and smaller values.

#include <cstddef>

namespace splitcubes::body::tuning {

/// Elements per chunk of parallel loops. Results do not depend on them. Larger ones leave threads idle,
/// smaller ones cost scheduling; about ten microseconds of work.
namespace grains {

/// Phyxels whose stress is measured.
inline constexpr std::size_t stressed_phyxels = 256;
/// Nodes at which the stress is averaged.
inline constexpr std::size_t stress_nodes = 32;
/// Cells that are searched for edges that cracks have passed.
inline constexpr std::size_t passed_cells = 8;
/// Nodes or edges at which a crack may start.
inline constexpr std::size_t crack_starts = 8;
/// Open edges beside crack faces.
inline constexpr std::size_t crack_faces = 256;
/// Edges ahead of a crack front.
inline constexpr std::size_t front_edges = 16;
/// Cells of a front, and a quarter of the cells with a crack in a chunk.
inline constexpr std::size_t crack_cells = 64;
/// Bricks near a moving blade.
inline constexpr std::size_t moving_bricks = 4;

}  // namespace grains

/// Set-up of bodies, reading of their state, bookkeeping of changes.
namespace set_up {

/// Bricks of a long serial loop between two checks for cancellation, 100 to 1e5. More react later, fewer cost
/// time.
inline constexpr std::size_t bricks_between_checks = 4096;
/// The same for cells of the surface.
inline constexpr std::size_t cells_between_checks = 4096;
/// B, estimated memory of a phyxel with its links and its share of the nodes; measured. Larger refuses bodies
/// that would fit; smaller lets the machine run out of memory.
inline constexpr double bytes_per_phyxel = 14e3;
/// Maximum number of lattice points in the search for thin parts; larger grids are subsampled. More are more
/// accurate and take more time and memory.
inline constexpr double max_lattice_points = 1e6;
/// Grid cells per side of a cube that records changes of the surface, from 1. Larger ones report more false
/// changes; smaller ones take memory.
inline constexpr double cells_per_change_cube = 1;
/// Maximum number of these cubes: limits memory to 8 MiB per body.
inline constexpr double max_change_cubes = 1 << 21;
/// Share of a cube's side by which queried and marked boxes grow, 1e-9 to 0.01: covers the callers' rounding
/// errors.
inline constexpr double change_cube_margin = 1e-6;
/// Largest deviation of a stored rotation of a phyxel from orthogonality, 1e-6 to 0.01. Larger accepts
/// damaged states, smaller refuses rounding.
inline constexpr double rotation_tolerance = 1e-3;
/// Doublings of the radius, from 1.5 spacings, in the search for the nearest phyxel of a piece; then all
/// phyxels are compared. Affects time only.
inline constexpr int max_radius_doublings = 4;
/// Nodes, maximum of a search over uncut edges for the nearest node whose influences are known, 100 to 1e5.
/// More cost time; fewer leave more nodes with influences of their own.
inline constexpr std::size_t max_source_search = 4096;

}  // namespace set_up

/// New phyxels, rigid fragments and ligaments.
namespace resampling {

/// Phyxels that a small piece gets, if it has as many nodes, before the ranks of neighbourhoods are checked;
/// 4 to 20. More cost time; fewer leave rank-deficient neighbourhoods.
inline constexpr std::size_t min_piece_phyxels = 8;
/// Iterations that add phyxels to neighbourhoods that do not span space, 1 to 5. More cost time and phyxels;
/// fewer leave more rank-deficient neighbourhoods.
inline constexpr int rank_iterations = 3;
/// Phyxels added to such a neighbourhood per iteration, 1 to 3; same effect.
inline constexpr int phyxels_per_rank_iteration = 3;
/// Spacings, 1 to 4, about one support radius. A shorter piece is rigid: each of its phyxels would have all
/// others as neighbours, and its deformation would hardly be visible. Larger makes visible splinters stiff;
/// smaller keeps pieces whose strain is not resolved.
inline constexpr double rigid_length = 2;
/// A piece with fewer phyxels that is also shorter than small_length is small: it gets more phyxels, and
/// starts without strain if these, or the cut, would give it elastic energy. Larger resets the strain of more
/// pieces; smaller leaves coarse ones.
inline constexpr std::size_t small_phyxel_count = 64;
/// Spacings, above rigid_length; length of a small piece.
inline constexpr double small_length = 6;
/// Strain below which elastic energy counts as noise, 1e-6 to 1e-3. Larger keeps strain that new phyxels
/// released; smaller resets strain because of rounding.
inline constexpr double noise_strain = 1e-4;
/// Visibility of a pair that bridges a ligament, above 0 and far below 1. Larger affects phyxels with other
/// neighbours; a phyxel without others follows its bridges at any value.
inline constexpr float bridge_visibility = 0.1F;
/// Phyxels; a connected group of more is no ligament. Bounds the search.
inline constexpr std::size_t max_ligament_size = 200;
/// Grid edges by which a path through the material may be longer than the path without cuts, 0 to 6. Larger
/// bridges phyxels around the end of a cut; smaller leaves ligaments loose.
inline constexpr int max_bridge_detour = 2;

}  // namespace resampling

/// Cuts by tools (rest_cut.cpp, node_ties.cpp, idle_tools.cpp, moving_bricks.cpp).
namespace cutting {

/// Share of an edge from its end, 1e-6 to 0.01, within which a hit counts as a hit of the node. Larger moves
/// cuts to nodes; smaller leaves cuts through a node with gaps.
inline constexpr double node_hit_share = 1e-4;
/// Component of a unit normal along an edge, 1e-9 to 1e-3, below which the edge lies in the cut. Larger takes
/// slightly inclined edges for it; smaller decides by rounding.
inline constexpr double in_plane_cosine = 1e-6;
/// Cells, size of boxes of a cut at rest that are not halved further; 1 to 8. Larger tests more edges,
/// smaller halves more; affects time only.
inline constexpr double rest_cut_leaf_size = 2;
/// Maximum number of halvings; reached only by extreme coordinates.
inline constexpr int rest_cut_max_depth = 100;
/// Points, about the most per line of a blade at which an idle tool in a body is followed, every half spacing
/// otherwise. More cost time; fewer follow the deformation less.
inline constexpr int max_idle_points = 200;
/// Every so many phyxels are averaged to the motion relative to which bricks are bounded. Larger saves time
/// and may widen bounds, which changes no result.
inline constexpr std::size_t motion_sample_stride = 32;

}  // namespace cutting

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
/// Where each side of the cube of directions is divided, along both of its axes, 0 to 1. The middle part
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
/// How much farther than the nearest sample a face is followed, 0.25 to 1. Larger averages over bends;
/// smaller makes gaps jump from sample to sample.
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
/// Maximum depenetration per step out of colliders, 0 to 0.1. The springs undo a quarter of it (meshless,
/// contact::depenetration_share).
inline constexpr double collider_depenetration_share = 0.02;
/// Maximum distance of a rendered vertex from its influences' mean in the bound of a sample's motion, 0.1 to
/// 1. Smaller may miss contacts of strained material, larger costs time.
inline constexpr double max_vertex_offset_share = 0.5;
/// Bound on the sum of a side's absolute weights, from 1. Larger widens the search; smaller may miss
/// contacts.
inline constexpr double max_weight_sum = 4;

}  // namespace contacts

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
/// Limit of the believed displacement of a surface or fragment per step, 0.5 to 10. Bounds the search: larger
/// costs time, smaller misses fast ones.
inline constexpr double max_displacement_share = 2;
/// Dot product of normals above which samples belong to one face.
inline constexpr double one_face_cosine = 0.8;
/// How much farther than the nearest sample a face is followed.
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
/// Share of the fastest approach, above converged_share: smaller changes end the iterations, too, once they
/// stagnate, as where a surface closes on a fragment from two sides.
inline constexpr double stagnation_share = 0.02;
/// Iterations stagnate if stagnation_check_interval of them leave more than this share of the changes, 0 to
/// 1. Larger iterates longer in vain, smaller gives up early.
inline constexpr double stagnation_ratio = 0.75;
/// Iterations between checks for stagnation, 2 to 50.
inline constexpr int stagnation_check_interval = 10;

}  // namespace fragments

/// Cracks: where they begin, how they grow, what they leave (Tearing and its parts; docs/replication.md).
namespace tearing {

/// Cosine of 60 degrees: largest angle between the planes of one crack, and between a crack's normal and the
/// principal direction where the crack grows. Larger makes cracks stop where the stress turns and shields
/// less beside them; smaller lets them turn sharply and suppresses branches.
inline constexpr double min_opening_cosine = 0.5;
/// Edge lengths beyond its ends, 0 to 0.5, in which a plane still counts as crossing an edge. Planes of one
/// crack differ by about as much; an edge that all of them miss would stay as a ligament. Larger cuts edges
/// beside the crack.
inline constexpr double edge_slack = 0.1;
/// Stress implied by the crack opening, over the strength, from which on a crack may split off a slab; above
/// 1. Larger has fewer parallel cracks, smaller more.
inline constexpr double slab_opening = 4;
/// Cosine of 45 degrees: largest angle between principal direction and deformed edge where a crack begins.
/// Every direction has an edge within 55 degrees; larger delays oblique cracks, smaller begins them on edges
/// that lie in the crack.
inline constexpr double min_edge_cosine = 0.7071;
/// Phyxels, 4 to 100; a piece with fewer resolves no stress field and does not tear. Smaller makes dust.
inline constexpr std::size_t min_tear_phyxels = 16;
/// Nodes, 8 to 1000; likewise.
inline constexpr std::size_t min_tear_nodes = 64;
/// Searches per step around phyxels where no edge turns out to be above its strength, 1 to 100. More cost
/// time; fewer may delay a crack by a step.
inline constexpr int max_vain_tries = 4;
/// Cells, 1 to 5: largest distance between the two sheets of a step in a crack whose riser is cut. Larger
/// closes more gaps between cracks, but may join cracks that would pass each other.
inline constexpr int max_riser = 3;
/// Passes that cut edges that cracks have passed, 1 to 10; each may make new ones. More cost time, fewer
/// leave ligaments until the next step.
inline constexpr int max_passed_edge_passes = 4;
/// Cells, 2 to 6: radius of the ball in which a weak plane is looked for. Larger finds planes that are far
/// away and blurs bent ones; smaller sees too little of the layer; time grows with its cube.
inline constexpr int weak_plane_radius = 3;
/// Share of the principal direction in the normal of a crack's continuation, 0 to 1. The phyxels' stress is
/// noisy around a tip, so larger makes cracks rough; smaller makes them turn late. max_turn_tangent and
/// certain_shielding_cosine follow from it.
inline constexpr double turning_share = 0.25;
/// Tangent of the largest angle by which a crack's plane turns in one continuation: 13.9 degrees, atan(t sin
/// a / (1 - t + t cos a)) for the share t = turning_share of a direction a = 60 degrees off
/// (min_opening_cosine).
inline constexpr double max_turn_tangent = 0.2475;
/// Cosine of 45 degrees less that angle. If a tip's normal is this close to a crossing's, each normal that it
/// may propose is within 45 degrees of it, hence also their mean over several tips, well within
/// min_opening_cosine.
inline constexpr double certain_shielding_cosine = 0.857;
/// Relative margin of bounds on stress, 1e-9 to 1e-3, far above the rounding error of the bound and of the
/// bounded values. Larger costs time, smaller misses loads.
inline constexpr double stress_bound_slack = 1e-6;
/// Share of its volume at rest, 0 to 0.5: a phyxel compressed below that, or inverted, is left out of the
/// stress field. Larger leaves out crushed material, smaller trusts stresses that the material law does not
/// resolve.
inline constexpr double min_volume_share = 0.05;

}  // namespace tearing

}  // namespace splitcubes::body::tuning
