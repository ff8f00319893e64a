// Nucleation: where new cracks begin.
#pragma once

#include <splitcubes/fracture/crack_cells.h>
#include <splitcubes/fracture/crack_front.h>
#include <splitcubes/fracture/stress_field.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace splitcubes::body {

/// Beginning of cracks in one body: at edges whose stress is above the strength, normal to the principal
/// direction or along a weak plane, and away from other cracks; see Tearing.
class CrackNucleation {
  public:
    /// The referenced parts must outlive this object.
    CrackNucleation(const StrengthField& strength, StressField& stress, CrackCells& cells, CrackFront& front,
                    const meshless::Material& material);

    /// Begins cracks around the phyxels that are loaded above their strength, the most loaded first, grows
    /// each in the same step, and appends the slots of the cuts.
    void begin_cracks(splitting::NodeGrid& grid, const TearContext& context,
                      std::vector<std::int32_t>& slots);

  private:
    /// Node of an edge at which a crack may begin.
    struct StartNode {
        Vec3i node;
        std::int32_t index;  // tracker index, or -1
        StressSum sum;
    };
    /// Edge at which a crack may begin.
    struct StartEdge {
        splitting::GridEdge edge;
        std::uint32_t lower, upper;  // start nodes
        Vec3 rest = Vec3::Zero();    // m, its middle
        double strength = 0;         // Pa
        EdgeStress stress;           // zero if it is below the strength
    };
    /// Crossing of a crack.
    struct CrackPoint {
        Vec3 rest, normal;  // m, unit; rest space
    };
    struct KeyHash {
        std::size_t operator()(const CellKey& key) const {
            return static_cast<std::size_t>(key[0]) * 73856093U ^
                   static_cast<std::size_t>(key[1]) * 19349663U ^
                   static_cast<std::size_t>(key[2]) * 83492791U;
        }
    };

    void note_crack_points(const splitting::NodeGrid& grid);
    bool is_beside_crack(const Vec3& rest, const Vec3& rest_normal, double load) const;
    void list_starts(const splitting::NodeGrid& grid, const TearContext& context, std::uint32_t phyxel);
    void consider_start(const splitting::NodeGrid& grid, std::uint32_t phyxel, const StartEdge& start,
                        CutProposal& best) const;
    bool begin_crack_at(splitting::NodeGrid& grid, const TearContext& context, std::uint32_t phyxel,
                        std::vector<std::int32_t>& slots);

    const StrengthField& strength_;
    StressField& stress_;
    CrackCells& cells_;
    CrackFront& front_;
    double wave_speed_ = 0;             // m/s, of pressure waves
    std::vector<std::uint32_t> order_;  // phyxels loaded above their strength, the most loaded first
    // Around one phyxel. The last one: per node in a box around it, index in start_nodes_ or -1.
    std::vector<StartNode> start_nodes_;
    std::vector<StartEdge> starts_;
    std::vector<std::int32_t> start_indices_;
    // Cuts by cubes of side cube_, each cube named by its integer coordinates.
    std::unordered_map<CellKey, std::vector<CrackPoint>, KeyHash> crack_points_;
    double cube_ = 0;               // m
    std::size_t known_points_ = 0;  // crossings of the grid that crack_points_ covers
};

}  // namespace splitcubes::body
