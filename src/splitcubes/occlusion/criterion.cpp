#include <splitcubes/occlusion/criterion.h>
#include <splitcubes/occlusion/segment_criteria.h>
#include <splitcubes/occlusion/tuning.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace splitcubes::occlusion {

namespace {

PairQuery query(const PairSet& pairs, std::size_t pair) {
    return {pairs.rest[pairs.a[pair]], pairs.rest[pairs.b[pair]]};
}

geometry::Box box_of(const PairQuery& pair, double margin) {
    return geometry::Box{pair.a.cwiseMin(pair.b), pair.a.cwiseMax(pair.b)}.grown(margin);
}

class DiskCriterion final : public Criterion {
  public:
    explicit DiskCriterion(std::unique_ptr<VisibilityBackend> disks) : disks_(std::move(disks)) {
        assert(disks_ != nullptr);
    }
    std::string name() const override { return criterion_names[0]; }
    void evaluate(const geometry::OccluderGrid& occluders, const PairSet& pairs,
                  std::span<const std::uint32_t> requested, std::span<float> factor,
                  const Parallel& parallel) override {
        queries_.clear();
        for (const std::uint32_t k : requested) queries_.push_back(query(pairs, k));
        disks_->evaluate(occluders, queries_, factor, parallel);
    }
    geometry::Box region(const PairSet& pairs, std::size_t pair) const override {
        return double_cone_bounds(query(pairs, pair));
    }
    // The radius of a disk is half the pair's distance.
    double range(double reach) const override { return 1.01 * reach; }

  private:
    std::unique_ptr<VisibilityBackend> disks_;
    std::vector<PairQuery> queries_;
};

class VisibilityCriterion final : public Criterion {
  public:
    std::string name() const override { return criterion_names[1]; }
    void evaluate(const geometry::OccluderGrid& occluders, const PairSet& pairs,
                  std::span<const std::uint32_t> requested, std::span<float> factor,
                  const Parallel& parallel) override {
        parallel.for_each(requested.size(), 64, [&](std::size_t k) {
            factor[k] = segment_blocked(occluders, query(pairs, requested[k])) ? 0.0F : 1.0F;
        });
    }
    geometry::Box region(const PairSet& pairs, std::size_t pair) const override {
        const PairQuery ends = query(pairs, pair);
        return box_of(ends, tuning::criteria::box_margin * (ends.b - ends.a).norm());
    }
};

class TransparencyCriterion final : public Criterion {
  public:
    std::string name() const override { return criterion_names[2]; }
    void evaluate(const geometry::OccluderGrid& occluders, const PairSet& pairs,
                  std::span<const std::uint32_t> requested, std::span<float> factor,
                  const Parallel& parallel) override {
        parallel.for_each(requested.size(), 16, [&](std::size_t k) {
            factor[k] = static_cast<float>(
                transparency_factor(occluders, query(pairs, requested[k]), pairs.reach(requested[k])));
        });
    }
    geometry::Box region(const PairSet& pairs, std::size_t pair) const override {
        return box_of(query(pairs, pair),
                      (transparent_share + tuning::criteria::box_margin) * pairs.reach(pair));
    }
};

class GraphCriterion final : public Criterion {
  public:
    std::string name() const override { return criterion_names[3]; }
    void evaluate(const geometry::OccluderGrid& occluders, const PairSet& pairs,
                  std::span<const std::uint32_t> requested, std::span<float> factor,
                  const Parallel& parallel) override {
        const LinkGraph graph(occluders, pairs);
        parallel.for_chunks(requested.size(), 32, [&](std::size_t begin, std::size_t end) {
            LinkGraph::Search search;
            for (std::size_t k = begin; k < end; ++k)
                factor[k] = factor_of(graph, pairs, requested[k], search);
        });
    }
    // A path no longer than the support extends at most half the support beyond the two phyxels.
    geometry::Box region(const PairSet& pairs, std::size_t pair) const override {
        return box_of(query(pairs, pair), (0.5 + tuning::criteria::box_margin) * pairs.reach(pair));
    }
    bool depends_on_others() const override { return true; }

  private:
    static float factor_of(const LinkGraph& graph, const PairSet& pairs, std::size_t pair,
                           LinkGraph::Search& search) {
        if (!graph.blocked(pair)) return 1;
        const std::uint32_t a = pairs.a[pair], b = pairs.b[pair];
        const double reach = pairs.reach(pair);
        // The last bits of sums along a path depend on its direction, so the search always starts from the
        // lower phyxel.
        graph.search(std::min(a, b), reach, search, std::max(a, b));
        const double r = (pairs.rest[b] - pairs.rest[a]).norm();
        const double d = std::max(search.distance[std::max(a, b)], r);
        return static_cast<float>(weight_ratio(r, d, reach));
    }
};

}  // namespace

double weight_ratio(double r, double d, double h) {
    if (!(d < h)) return 0;
    if (!(r < d)) return 1;
    const double ratio = (h * h - d * d) / (h * h - r * r);
    return ratio * ratio * ratio;
}

std::unique_ptr<Criterion> make_criterion(CriterionKind kind, std::unique_ptr<VisibilityBackend> disks) {
    switch (kind) {
        case CriterionKind::visibility:
            return std::make_unique<VisibilityCriterion>();
        case CriterionKind::transparency:
            return std::make_unique<TransparencyCriterion>();
        case CriterionKind::graph_distance:
            return std::make_unique<GraphCriterion>();
        case CriterionKind::occlusion_disk:
            break;
    }
    return std::make_unique<DiskCriterion>(std::move(disks));
}

}  // namespace splitcubes::occlusion
