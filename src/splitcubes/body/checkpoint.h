// A simulation's state as bytes, from which it goes on as if nothing had been.
#pragma once

#include <splitcubes/body/world.h>

#include <string>
#include <string_view>

namespace splitcubes::body {

/// The whole state of the world between two steps. `identity` names what the world
/// was made from (a scene's text, say): only a world made from the same can take it
/// back. `notes` is kept along for the caller. The bytes are of this machine's byte
/// order and this version of the library.
std::string encode_checkpoint(World& world, std::string_view identity, std::string_view notes = {});

/// Throws InputError, whose place is `name`, for bytes that are no checkpoint of this version of the
/// library, are cut off or damaged. What they hold is not looked at.
void check_checkpoint(std::string_view bytes, const std::string& name);

/// Puts the state into a world that was made from the same settings, bodies and tools and that
/// has not made a step. Every further step then gives, to the last bit, what it would have
/// given in the first. Returns the notes. Throws InputError, whose place is `name`, for
/// bytes that are no checkpoint, are cut off or damaged, or come from another
/// version or from other settings; the world must not be used then.
std::string restore_checkpoint(World& world, std::string_view bytes, std::string_view identity,
                               const std::string& name);

}  // namespace splitcubes::body
