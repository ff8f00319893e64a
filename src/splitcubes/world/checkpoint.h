// Checkpoints: the state of a simulation as bytes, from which it continues identically.
#pragma once

#include <splitcubes/world/world.h>

#include <string>
#include <string_view>

namespace splitcubes::body {

/// Returns the whole state of the world between two steps. `identity` identifies the input from which the
/// world was made (e.g. the text of a scene): only a world made from the same input can be restored. `notes`
/// is stored for the caller. The bytes depend on this machine's byte order and this version of the library.
std::string encode_checkpoint(World& world, std::string_view identity, std::string_view notes = {});

/// Throws InputError, located at `name`, if the bytes are no checkpoint of this version of the library,
/// truncated or damaged. Checks header and checksum only, not the state.
void check_checkpoint(std::string_view bytes, const std::string& name);

/// Restores the state into a world that was made from the same settings, bodies and tools and has made no
/// step. Every further step then has bit-identical results to those of the saved world. Returns the notes.
/// Throws InputError, located at `name`, if the bytes are no checkpoint, truncated, damaged, or from another
/// version or other settings; the world must not be used then.
std::string restore_checkpoint(World& world, std::string_view bytes, std::string_view identity,
                               const std::string& name);

}  // namespace splitcubes::body
