#include <splitcubes/core/checksum.h>
#include <splitcubes/core/error.h>
#include <splitcubes/core/state_stream.h>
#include <splitcubes/world/checkpoint.h>

#include <cstring>

namespace splitcubes::body {

namespace {

// The number is raised with every change of the stored data or of the results of a step.
constexpr std::string_view any_signature = "Splitcubes checkpoint ";
constexpr std::string_view signature = "Splitcubes checkpoint 15\n";

struct Head {
    std::uint64_t identity = 0, length = 0, checksum = 0;
};

Head checked_head(std::string_view bytes, const std::string& name) {
    if (!bytes.starts_with(any_signature))
        throw InputError(name, "is not a checkpoint", "give a file that 'run --checkpoint-every' wrote");
    if (!bytes.starts_with(signature))
        throw InputError(name, "is a checkpoint of another version of the program",
                         "go on with the version that wrote it, or start again");
    bytes.remove_prefix(signature.size());
    Head head;
    if (bytes.size() >= sizeof head) std::memcpy(&head, bytes.data(), sizeof head);
    if (bytes.size() < sizeof head || bytes.size() - sizeof head != head.length ||
        checksum(bytes.substr(sizeof head)) != head.checksum)
        throw InputError(name, "is damaged or cut off", "go back to an earlier checkpoint, or start again");
    return head;
}

}  // namespace

std::string encode_checkpoint(World& world, std::string_view identity, std::string_view notes) {
    StateWriter payload;
    payload.add_text(notes);
    world.save(payload);
    const std::string bytes = payload.take();
    const Head head{checksum(identity), bytes.size(), checksum(bytes)};
    std::string out;
    out.reserve(signature.size() + sizeof head + bytes.size());
    out += signature;
    out.append(reinterpret_cast<const char*>(&head), sizeof head);
    return out += bytes;
}

void check_checkpoint(std::string_view bytes, const std::string& name) {
    checked_head(bytes, name);
}

std::string restore_checkpoint(World& world, std::string_view bytes, std::string_view identity,
                               const std::string& name) {
    const Head head = checked_head(bytes, name);
    bytes.remove_prefix(signature.size());
    if (head.identity != checksum(identity))
        throw InputError(name, "is a checkpoint of another scene",
                         "give the scene it was made from; only frames, threads and output may differ");
    try {
        StateReader payload(bytes.substr(sizeof head));
        std::string notes = payload.text();
        world.load(payload);
        payload.finish();
        return notes;
    } catch (const DamagedState& damaged) {
        throw InputError(name, std::string("is damaged: it holds ") + damaged.what(),
                         "go back to an earlier checkpoint, or start again");
    }
}

}  // namespace splitcubes::body
