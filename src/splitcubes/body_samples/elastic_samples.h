// The elastic samples of a body and all that links them to each other and to its material.
#pragma once

#include <splitcubes/occlusion/criterion.h>
#include <splitcubes/samples/mass_lumping.h>
#include <splitcubes/samples/neighbourhoods.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace splitcubes {
class StateReader;
class StateWriter;
namespace splitting {
class NodeGrid;
class Pieces;
}  // namespace splitting
}  // namespace splitcubes

namespace splitcubes::body {

struct MaterialNodes;
struct TopologyChange;

/// The topology in which the samples lie.
struct SampleContext {
    const splitting::NodeGrid& grid;
    const splitting::Pieces& pieces;
    const geometry::OccluderGrid& occluders;
    const MaterialNodes& nodes;
    const meshless::Material& material;
    const Isometry& pose;  // world at time 0 from rest space
    const Parallel& parallel;
};

/// Number and motion of the phyxels of an uncut body.
struct SampleSettings {
    std::string body;                      // its name, for messages
    double spacing = 0;                    // m; 0: chosen to match count
    int count = 0;                         // target; used only if no spacing is given
    Vec3 velocity = Vec3::Zero();          // m/s, world
    Vec3 angular_velocity = Vec3::Zero();  // rad/s, world, about the centre of mass
    bool at_centroids = true;              // phyxels near the surface move to centroids of the material
};

/// Phyxels, the pairs of them that are within reach, their visibility past the surface, and the mass lumped
/// to them. Resampler adds phyxels after a split.
struct ElasticSamples {
    explicit ElasticSamples(std::unique_ptr<occlusion::Criterion> criterion);
    ~ElasticSamples();

    meshless::Phyxels phyxels;
    meshless::PhyxelLocator locator;  // of the rest positions
    meshless::Pairs pairs;
    meshless::Neighbourhoods neighbourhoods;
    meshless::MassLumping lumping;           // of the inside nodes
    std::vector<Vec3i> owner;                // per phyxel: the inside node that decides its piece
    std::vector<Mat3> previous_deformation;  // per phyxel, one step ago
    double spacing = 0;                      // m, between phyxels
    std::size_t initial_count = 0;           // phyxels of the uncut body; the later ones lie at nodes
    std::unique_ptr<occlusion::Criterion> criterion;  // of the visibility of pairs

    /// Places the phyxels of an uncut body, links them and gives them mass and initial velocity. Announces
    /// its stages to the monitor.
    void place(const SampleContext& context, const SampleSettings& settings);
    void rebuild_locator();
    /// Links the phyxels that were appended since the last call: support radii, pairs and their visibility,
    /// neighbourhoods. Updates the links of change.dirty_pairs, too.
    void append_links(const SampleContext& context, TopologyChange& change);

    struct VisibilityUpdate {
        bool pieces_changed = false;  // of phyxels
        std::size_t evaluated = 0;    // pairs
    };
    /// Updates owners and pieces of the phyxels and the visibility of pairs after the occluders changed.
    /// Bridges ligaments. Adds to change.dirty_pairs.
    VisibilityUpdate update_visibility(const SampleContext& context, TopologyChange& change);

    /// Returns the pieces of an uncut body that cannot deform as they are: with few phyxels or none beside
    /// another piece, or with phyxels that are not linked. Ascending.
    std::vector<std::int32_t> coarse_parts(std::size_t piece_count) const;
    /// Returns the elastic fragments, small pieces beside a larger one, that rotate in a step of dt, s, by
    /// more than an implicit step can follow. Ascending.
    std::vector<std::int32_t> fast_fragments(std::size_t piece_count, double dt) const;
    /// Returns the number of phyxels of each piece.
    std::vector<std::size_t> count_by_piece(std::size_t piece_count) const;
    double largest_support() const;  // m
    /// Returns phyxels and pairs as input for a visibility criterion; spans refer to this object.
    occlusion::PairSet pair_set() const {
        return {phyxels.rest_position, phyxels.support_radius, phyxels.piece, pairs.a, pairs.b};
    }

    /// Writes the phyxels, the mass lumping, the rigid pieces and the pairs to a checkpoint.
    void save(const splitting::NodeGrid& grid, const meshless::Material& material, StateWriter& writer) const;
    /// Restores what save wrote into the samples of a body with the same settings and cuts. Throws
    /// DamagedState.
    void load(const SampleContext& context, StateReader& reader);

  private:
    void set_motion(const SampleContext& context, const SampleSettings& settings);
    void set_contact_radii(const SampleContext& context);
    void evaluate_pairs(const SampleContext& context, std::span<const std::uint32_t> requested);
    void save_phyxels(const splitting::NodeGrid& grid, const meshless::Material& material,
                      StateWriter& writer) const;
    void load_phyxels(const SampleContext& context, StateReader& reader);
    void load_new_phyxels(const SampleContext& context, StateReader& reader, std::size_t count);
    void check_supports(const SampleContext& context) const;
    void save_lumping(StateWriter& writer) const;
    void load_lumping(const SampleContext& context, StateReader& reader);
    void save_rigid(StateWriter& writer) const;
    void load_rigid(const SampleContext& context, StateReader& reader);
    void save_pairs(StateWriter& writer) const;
    void load_pairs(StateReader& reader);
};

/// Returns the nearest inside node that sees a point (m, rest space) and whose piece is accepted; among
/// equally near ones the first in grid order; the fallback if none of the 27 nodes around is.
Vec3i owner_of(const SampleContext& context, const Vec3& rest, const Vec3i& fallback,
               const std::function<bool(std::int32_t piece)>& accepts);

}  // namespace splitcubes::body
