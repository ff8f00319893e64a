#include <splitcubes/samples/mass_centres.h>
#include <splitcubes/samples/tuning.h>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>

namespace splitcubes::meshless {

namespace {

// Mass of a piece in rest space, by its phyxels, and the moment that they lack.
struct PieceMass {
    double mass = 0;              // kg
    double support = 0;           // kg m, sum of mass times support radius
    Vec3 centre = Vec3::Zero();   // m; a first moment while it is summed
    Vec3 lacking = Vec3::Zero();  // kg m
    Mat3 spread = Mat3::Zero();   // kg m^2, about the centre
    Mat3 axes = Mat3::Zero();     // principal axes in columns, by ascending extent
    Vec3 reach = Vec3::Zero();    // m, largest distance of a phyxel from the centre along each
    Vec3 change = Vec3::Zero();   // 1/m, relative change of mass along each
};

class MassCentres {
  public:
    MassCentres(const MaterialNodes& nodes, double density, Phyxels& phyxels)
        : nodes_(nodes), density_(density), phyxels_(phyxels) {}

    void run() {
        sum_phyxels();
        subtract_from_nodes();
        for (PieceMass& piece : pieces_) find_changes(piece);
        find_reaches();
        for (PieceMass& piece : pieces_) limit_changes(piece);
        change_masses();
    }

  private:
    PieceMass& of(std::int32_t piece) { return pieces_[static_cast<std::size_t>(piece)]; }
    void sum_phyxels();
    void subtract_from_nodes();
    static void find_changes(PieceMass& piece);
    static void limit_changes(PieceMass& piece);
    void find_reaches();
    template <class Use>
    void for_members(const Use& use);
    void change_masses();

    const MaterialNodes& nodes_;
    double density_;
    Phyxels& phyxels_;
    std::vector<PieceMass> pieces_;
};

void MassCentres::sum_phyxels() {
    std::int32_t highest = -1;
    for (const std::int32_t piece : phyxels_.piece) highest = std::max(highest, piece);
    pieces_.assign(static_cast<std::size_t>(highest + 1), {});
    const std::size_t n = phyxels_.size();
    for (std::size_t i = 0; i < n; ++i) {
        if (phyxels_.piece[i] < 0) continue;
        PieceMass& piece = of(phyxels_.piece[i]);
        const double m = phyxels_.mass[i];
        piece.mass += m;
        piece.support += m * phyxels_.support_radius[i];
        piece.centre += m * phyxels_.rest_position[i];
    }
    for (PieceMass& piece : pieces_)
        if (piece.mass > 0) piece.centre /= piece.mass;
    for (std::size_t i = 0; i < n; ++i) {
        if (phyxels_.piece[i] < 0) continue;
        PieceMass& piece = of(phyxels_.piece[i]);
        const Vec3 d = phyxels_.rest_position[i] - piece.centre;
        piece.spread += phyxels_.mass[i] * d * d.transpose();
    }
}

void MassCentres::subtract_from_nodes() {
    const auto count = static_cast<std::int32_t>(pieces_.size());
    for (std::size_t b = 0; b < nodes_.piece.size(); ++b)
        if (nodes_.piece[b] >= 0 && nodes_.piece[b] < count)
            of(nodes_.piece[b]).lacking +=
                density_ * nodes_.volume[b] * (nodes_.rest_position[b] - of(nodes_.piece[b]).centre);
}

// Finds the changes c along the axes a with sum of m d (c . a . d) = what is lacking.
void MassCentres::find_changes(PieceMass& piece) {
    if (!(piece.mass > 0)) return;
    const double extent = tuning::lumping::min_extent * piece.support / piece.mass;
    const Eigen::SelfAdjointEigenSolver<Mat3> solver(piece.spread);
    piece.axes = solver.eigenvectors();
    for (int k = 0; k < 3; ++k)
        if (solver.eigenvalues()[k] > piece.mass * extent * extent)
            piece.change[k] = piece.axes.col(k).dot(piece.lacking) / solver.eigenvalues()[k];
    if (!piece.axes.allFinite() || !piece.change.allFinite()) piece.change.setZero();
}

template <class Use>
void MassCentres::for_members(const Use& use) {
    for (std::size_t i = 0; i < phyxels_.size(); ++i) {
        if (phyxels_.piece[i] < 0) continue;
        PieceMass& piece = of(phyxels_.piece[i]);
        if (!piece.change.isZero(0))
            use(i, piece, Vec3(piece.axes.transpose() * (phyxels_.rest_position[i] - piece.centre)));
    }
}

void MassCentres::find_reaches() {
    for_members([](std::size_t, PieceMass& piece, const Vec3& along) {
        piece.reach = piece.reach.cwiseMax(along.cwiseAbs());
    });
}

// Limits the sum of the changes: those along the largest extents come first.
void MassCentres::limit_changes(PieceMass& piece) {
    double left = tuning::lumping::max_mass_change;
    for (int k = 2; k >= 0; --k) {
        const double largest = std::abs(piece.change[k]) * piece.reach[k];
        if (largest > left) piece.change[k] *= left / largest;
        left -= std::min(largest, left);
    }
}

void MassCentres::change_masses() {
    for_members([&](std::size_t i, const PieceMass& piece, const Vec3& along) {
        phyxels_.mass[i] *= 1 + piece.change.dot(along);
    });
}

}  // namespace

void keep_centres_of_mass(const MaterialNodes& nodes, double density, Phyxels& phyxels) {
    MassCentres(nodes, density, phyxels).run();
}

}  // namespace splitcubes::meshless
