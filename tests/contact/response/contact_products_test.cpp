// Products with springs equal those of the dense matrix, and their part of the preconditioner is symmetric,
// positive definite and close to the inverse.
#include <splitcubes/contact/response/contact_products.h>

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include <array>
#include <random>
#include <vector>

namespace splitcubes::meshless {
namespace {

constexpr std::size_t stride = 16;
constexpr Eigen::Index size = 3 * static_cast<Eigen::Index>(stride);

// Random springs between phyxels of one part, some without a lower side, one phyxel fixed, and an attachment
// spring. `matrix`: their stiffness; `diagonal`: of the rest.
struct Springs {
    explicit Springs(unsigned seed) : random(seed), mobility(stride), fixed(stride, 0) {
        std::uniform_int_distribution<std::uint32_t> any(0, stride - 1);
        for (double& m : mobility) m = 1 / (50 + 100 * positive(random));
        fixed[3] = 1;
        const std::size_t counts[] = {stride};
        products.clear(counts);
        for (int k = 0; k < 60; ++k) {
            Contact contact;
            contact.normal = Vec3(value(random), value(random), 2).normalized();
            fill(contact.upper, any);
            if (k % 2 == 0) fill(contact.lower, any);
            const double along = 40 * positive(random), across = k % 3 == 0 ? 0 : along * positive(random);
            products.add(contact, along, across);
            add_truth(contact, along, across);
        }
        HandleSpring handle_spring;
        handle_spring.phyxel = 5;
        products.add(handle_spring, 80);
        for (int k = 0; k < 3; ++k) matrix(at(5, k), at(5, k)) += 80;
        const ContactProducts::Diagonal diagonals[] = {{mobility, mobility, fixed}};
        products.finish();
        products.set_diagonals(diagonals);
    }
    static Eigen::Index at(std::size_t phyxel, int k) {
        return static_cast<Eigen::Index>(static_cast<std::size_t>(k) * stride + phyxel);
    }
    void fill(ContactSide& side, std::uniform_int_distribution<std::uint32_t>& any) {
        side.count = 4;
        double sum = 0;
        for (std::uint32_t k = 0; k < side.count; ++k) {
            // Distinct phyxels.
            side.phyxel[k] = 4 * k + any(random) % 4;
            sum += side.weight[k] = 0.1 + positive(random);
        }
        for (std::uint32_t k = 0; k < side.count; ++k) side.weight[k] /= sum;
    }
    void add_truth(const Contact& contact, double along, double across) {
        Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(3, size);
        double sign = 1;
        for (const ContactSide* side : {&contact.upper, &contact.lower}) {
            for (std::uint32_t e = 0; e < side->count; ++e)
                for (int k = 0; k < 3; ++k) weights(k, at(side->phyxel[e], k)) += sign * side->weight[e];
            sign = -1;
        }
        const Mat3 stiffness =
            across * Mat3::Identity() + (along - across) * contact.normal * contact.normal.transpose();
        matrix += weights.transpose() * stiffness * weights;
    }
    // Applies smooth to a residual and adds the diagonal part; zero for fixed phyxels.
    Eigen::VectorXd smoothed(const Eigen::VectorXd& residual, double& product) {
        const Eigen::VectorXf in = residual.cast<float>();
        Eigen::VectorXf out = Eigen::VectorXf::Zero(size);
        const ContactProducts::RowPart rows[] = {{stride, in.data(), out.data()}};
        product = products.smooth(rows, Parallel(1));
        products.add_smoothed(rows);
        Eigen::VectorXd sum = out.cast<double>();
        for (std::size_t i = 0; i < stride; ++i)
            for (int k = 0; k < 3; ++k)
                if (fixed[i] == 0) sum[at(i, k)] += mobility[i] * residual[at(i, k)];
        return sum;
    }

    std::mt19937 random;
    std::uniform_real_distribution<double> value{-1, 1}, positive{0, 1};
    std::vector<double> mobility;
    std::vector<std::uint8_t> fixed;
    ContactProducts products;
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(size, size);
};

TEST(ContactProducts, EqualTheDenseMatrixProduct) {
    Springs springs(1);
    const Eigen::VectorXd x =
        Eigen::VectorXd::NullaryExpr(size, [&] { return springs.value(springs.random); });
    const Eigen::VectorXd truth = springs.matrix * x;
    const Eigen::VectorXf in = x.cast<float>();
    for (const int threads : {1, 2, 3}) {
        Eigen::VectorXf out = Eigen::VectorXf::Ones(size);
        const ContactProducts::RowPart rows[] = {{stride, in.data(), out.data()}};
        const double product = springs.products.apply(rows, Parallel(threads));
        EXPECT_LT((out.cast<double>() - Eigen::VectorXd::Ones(size) - truth).norm(), 1e-5 * truth.norm());
        EXPECT_NEAR(product, x.dot(truth), 1e-5 * x.dot(truth));
    }
}

// Changing the stiffness of listed springs gives the same result as listing them with it.
TEST(ContactProducts, ChangingAStiffnessEqualsANewList) {
    const std::size_t counts[] = {stride};
    std::mt19937 random(5);
    std::uniform_real_distribution<double> positive{0, 1};
    ContactProducts changed, fresh;
    changed.clear(counts);
    fresh.clear(counts);
    for (std::uint32_t k = 0; k < 20; ++k) {
        Contact contact;
        contact.normal = Vec3(positive(random), positive(random), 1).normalized();
        contact.upper.count = 2;
        contact.upper.phyxel = {k % 16, (k + 3) % 16};
        contact.upper.weight = {0.25, 0.75};
        const double along = positive(random), across = along * positive(random);
        changed.add(contact, 7, 3);
        changed.set(k, along, across);
        fresh.add(contact, along, across);
    }
    HandleSpring handle_spring;
    changed.add(handle_spring, 2);
    changed.set(20, 9, 9);
    fresh.add(handle_spring, 9);
    const Eigen::VectorXf in = Eigen::VectorXf::Random(size);
    std::array<Eigen::VectorXf, 2> out;
    for (ContactProducts* products : {&changed, &fresh}) {
        products->finish();
        Eigen::VectorXf& to = out[products == &fresh] = Eigen::VectorXf::Zero(size);
        const ContactProducts::RowPart rows[] = {{stride, in.data(), to.data()}};
        products->apply(rows, Parallel(1));
    }
    EXPECT_GT(out[0].norm(), 0);
    EXPECT_EQ(out[0], out[1]);
}

// Compares the smoothing operator, column by column, with the inverse that it approximates.
TEST(ContactProducts, SmoothingIsSymmetricPositiveAndNearTheInverse) {
    for (const unsigned seed : {2U, 3U, 4U}) {
        Springs springs(seed);
        std::vector<Eigen::Index> moving;
        for (Eigen::Index i = 0; i < size; ++i)
            if (springs.fixed[static_cast<std::size_t>(i) % stride] == 0) moving.push_back(i);
        Eigen::MatrixXd smoothing(size, size);
        for (Eigen::Index i = 0; i < size; ++i) {
            double product = 0;
            smoothing.col(i) = springs.smoothed(Eigen::VectorXd::Unit(size, i), product);
            if (springs.fixed[static_cast<std::size_t>(i) % stride] == 0) {
                EXPECT_NEAR(product + springs.mobility[static_cast<std::size_t>(i) % stride], smoothing(i, i),
                            1e-6);
            }
        }
        Eigen::MatrixXd system = springs.matrix;
        for (Eigen::Index i = 0; i < size; ++i)
            system(i, i) += 1 / springs.mobility[static_cast<std::size_t>(i) % stride];
        const Eigen::MatrixXd b = smoothing(moving, moving), a = system(moving, moving);
        EXPECT_LT((b - b.transpose()).norm(), 1e-5 * b.norm());
        // Spectrum of the product, from the symmetric root of the matrix.
        const Eigen::MatrixXd root = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(a).operatorSqrt();
        const Eigen::VectorXd spectrum =
            Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(root * b * root).eigenvalues();
        EXPECT_GT(spectrum.minCoeff(), 0.6);
        EXPECT_LT(spectrum.maxCoeff(), 1.3);
    }
}

}  // namespace
}  // namespace splitcubes::meshless
