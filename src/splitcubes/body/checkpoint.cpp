#include <splitcubes/body/checkpoint.h>
#include <splitcubes/core/error.h>

#include <cereal/archives/binary.hpp>
#include <cereal/types/array.hpp>
#include <cereal/types/string.hpp>
#include <cereal/types/vector.hpp>

#include <cstring>
#include <sstream>

namespace Eigen {

// Of fixed size only: what is stored is the bytes of the coefficients.
template <class Archive, class Scalar, int Rows, int Columns, int Options>
void serialize(Archive& archive, Matrix<Scalar, Rows, Columns, Options>& matrix) {
    static_assert(Rows > 0 && Columns > 0);
    archive(cereal::binary_data(matrix.data(), sizeof(Scalar) * static_cast<std::size_t>(matrix.size())));
}

}  // namespace Eigen

namespace splitcubes::body {

namespace {

// Raised with every change of what is stored or of what a step makes of it.
constexpr std::string_view signature = "Splitcubes checkpoint 3\n";

std::uint64_t checksum(std::string_view bytes) {
    StateHash hash;
    for (; bytes.size() >= 8; bytes.remove_prefix(8)) {
        std::uint64_t word = 0;
        std::memcpy(&word, bytes.data(), sizeof word);
        hash.add_word(word);
    }
    for (const char c : bytes) hash.add_word(static_cast<unsigned char>(c));
    return hash.value();
}

struct Head {
    std::uint64_t identity = 0, length = 0, checksum = 0;
};

}  // namespace

std::string encode_checkpoint(World& world, std::string_view identity, std::string_view notes) {
    std::ostringstream payload;
    cereal::BinaryOutputArchive archive(payload);
    archive(std::string(notes), world);
    const std::string bytes = std::move(payload).str();
    const Head head{checksum(identity), bytes.size(), checksum(bytes)};
    std::string out(signature);
    out.append(reinterpret_cast<const char*>(&head), sizeof head);
    return out + bytes;
}

std::string restore_checkpoint(World& world, std::string_view bytes, std::string_view identity,
                               const std::string& name) {
    if (bytes.substr(0, signature.size()) != signature)
        throw InputError(name, "is no checkpoint of this version",
                         "give a file that 'run --checkpoint-every' of the same program wrote");
    bytes.remove_prefix(signature.size());
    Head head;
    if (bytes.size() >= sizeof head) std::memcpy(&head, bytes.data(), sizeof head);
    if (bytes.size() < sizeof head || bytes.size() - sizeof head != head.length ||
        checksum(bytes.substr(sizeof head)) != head.checksum)
        throw InputError(name, "is damaged or cut off", "go back to an earlier checkpoint, or start again");
    if (head.identity != checksum(identity))
        throw InputError(name, "is a checkpoint of another scene",
                         "give the scene it was made from; only frames, threads and output may differ");
    try {
        std::istringstream payload{std::string(bytes.substr(sizeof head))};
        cereal::BinaryInputArchive archive(payload);
        std::string notes;
        archive(notes, world);
        for (auto& body : world.bodies()) body->restore(world.parallel());
        return notes;
    } catch (const cereal::Exception& error) {
        throw InputError(name, std::string("cannot be read: ") + error.what());
    }
}

}  // namespace splitcubes::body
