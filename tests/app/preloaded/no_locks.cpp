// Preloaded in front of the C library: emulates a file system without locks.
#include <cerrno>
#include <cstdlib>

extern "C" int flock(int /*descriptor*/, int /*operation*/) {
    const char* const error = std::getenv("NO_LOCKS_ERROR");
    errno = error != nullptr ? std::atoi(error) : ENOLCK;
    return -1;
}
