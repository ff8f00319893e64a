#include <splitcubes/api/internal/state_archive.h>
#include <splitcubes/api/internal/state_file.h>
#include <splitcubes/core/atomic_file.h>
#include <splitcubes/core/checksum.h>
#include <splitcubes/core/error.h>
#include <splitcubes/core/memory.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>

namespace splitcubes::api {

namespace {

constexpr std::string_view any_mark = "Splitcubes simulation ";
// Raised with every change of what is stored; what a checkpoint stores and its steps make of it included.
constexpr std::string_view mark = "Splitcubes simulation 9\n";

struct Envelope {
    std::uint64_t length = 0, checksum = 0;
};

[[noreturn]] void refuse(const std::string& file, const std::string& problem) {
    throw Error(ErrorKind::bad_file, printable(file, 400) + ": " + problem);
}

std::string read_whole(const std::string& file) {
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(file, error);
    if (error) refuse(file, "cannot be read; is it there?");
    require_memory(file, static_cast<double>(size), "give another file");
    std::string out(size, '\0');
    std::ifstream in(file, std::ios::binary);
    if (!in.read(out.data(), static_cast<std::streamsize>(size))) refuse(file, "cannot be read");
    return out;
}

std::string_view checked_payload(std::string_view bytes, const std::string& file) {
    if (!bytes.starts_with(any_mark)) refuse(file, "is no saved simulation");
    if (!bytes.starts_with(mark)) refuse(file, "was saved by another version of the library");
    bytes.remove_prefix(mark.size());
    Envelope envelope;
    if (bytes.size() >= sizeof envelope) std::memcpy(&envelope, bytes.data(), sizeof envelope);
    if (bytes.size() < sizeof envelope || bytes.size() - sizeof envelope != envelope.length ||
        checksum(bytes.substr(sizeof envelope)) != envelope.checksum)
        refuse(file, "is damaged or cut off");
    return bytes.substr(sizeof envelope);
}

}  // namespace

void write_state_file(const std::string& file, const Snapshot& snapshot) {
    SavingArchive archive;
    Snapshot copy = snapshot;
    archive_snapshot(archive, copy);
    const std::string payload = archive.writer.take();
    const Envelope envelope{payload.size(), checksum(payload)};
    AtomicFile out(file);
    out.write(mark);
    out.write({reinterpret_cast<const char*>(&envelope), sizeof envelope});
    out.write(payload);
    out.commit();
}

Snapshot read_state_file(const std::string& file, const Parallel& parallel) {
    const std::string bytes = read_whole(file);
    const std::string_view payload = checked_payload(bytes, file);
    try {
        LoadingArchive archive{StateReader(payload)};
        Snapshot out;
        archive_snapshot(archive, out);
        archive.reader.finish();
        finish_loaded(out, parallel);
        return out;
    } catch (const DamagedState& damaged) {
        refuse(file, std::string("is damaged: it holds ") + damaged.what());
    } catch (const InputError& error) {
        refuse(file, std::string("is damaged: ") + error.what());
    }
}

}  // namespace splitcubes::api
