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
    Vec3 slope = Vec3::Zero();    // 1/m, relative change of mass
    double change = 0;            // largest relative change of a mass
};

class MassCentres {
  public:
    MassCentres(const MaterialNodes& nodes, double density, Phyxels& phyxels)
        : nodes_(nodes), density_(density), phyxels_(phyxels) {}

    void run() {
        sum_phyxels();
        subtract_from_nodes();
        for (PieceMass& piece : pieces_) find_slope(piece);
        change_masses();
    }

  private:
    PieceMass& of(std::int32_t piece) { return pieces_[static_cast<std::size_t>(piece)]; }
    void sum_phyxels();
    void subtract_from_nodes();
    static void find_slope(PieceMass& piece);
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

// Finds the slope s with sum of m d (d . s) = what is lacking, along axes in which the piece has an extent.
void MassCentres::find_slope(PieceMass& piece) {
    if (!(piece.mass > 0)) return;
    const double extent = tuning::lumping::min_extent * piece.support / piece.mass;
    const Eigen::SelfAdjointEigenSolver<Mat3> axes(piece.spread);
    for (int k = 0; k < 3; ++k) {
        const Vec3 axis = axes.eigenvectors().col(k);
        if (axes.eigenvalues()[k] > piece.mass * extent * extent)
            piece.slope += axis.dot(piece.lacking) / axes.eigenvalues()[k] * axis;
    }
    if (!piece.slope.allFinite()) piece.slope.setZero();
}

void MassCentres::change_masses() {
    const auto relative_change = [&](std::size_t i) {
        const PieceMass& piece = of(phyxels_.piece[i]);
        return piece.slope.dot(phyxels_.rest_position[i] - piece.centre);
    };
    for (std::size_t i = 0; i < phyxels_.size(); ++i)
        if (phyxels_.piece[i] >= 0)
            of(phyxels_.piece[i]).change =
                std::max(of(phyxels_.piece[i]).change, std::abs(relative_change(i)));
    for (PieceMass& piece : pieces_)
        if (piece.change > tuning::lumping::max_mass_change)
            piece.slope *= tuning::lumping::max_mass_change / piece.change;
    for (std::size_t i = 0; i < phyxels_.size(); ++i)
        if (phyxels_.piece[i] >= 0) phyxels_.mass[i] *= 1 + relative_change(i);
}

}  // namespace

void keep_centres_of_mass(const MaterialNodes& nodes, double density, Phyxels& phyxels) {
    MassCentres(nodes, density, phyxels).run();
}

}  // namespace splitcubes::meshless
