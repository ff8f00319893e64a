#include <splitcubes/api/internal/calls.h>
#include <splitcubes/core/error.h>
#include <splitcubes/core/state_stream.h>

#include <new>
#include <string>

namespace splitcubes::api {

void Gate::enter(bool is_writer) {
    int users = users_.load();
    do {
        if (users < 0 || (is_writer && users > 0))
            throw Error(ErrorKind::busy,
                        "simulation: another call is running; make calls one after the other, and none from "
                        "a region test");
    } while (!users_.compare_exchange_weak(users, is_writer ? -1 : users + 1));
}

void Gate::leave(bool is_writer) noexcept {
    if (is_writer)
        users_.store(0);
    else
        users_.fetch_sub(1);
}

void rethrow_as_error() {
    try {
        throw;
    } catch (const Error&) {
        throw;
    } catch (const InputError& error) {
        throw Error(ErrorKind::invalid_argument, error.what());
    } catch (const DamagedState& error) {
        throw Error(ErrorKind::bad_file, std::string("state: is damaged: it holds ") + error.what());
    } catch (const std::bad_alloc&) {
        throw Error(ErrorKind::out_of_memory, "simulation: not enough memory; make fewer or coarser bodies");
    } catch (const std::exception& error) {
        throw Error(ErrorKind::failed, error.what());
    } catch (...) {
        throw Error(ErrorKind::failed, "simulation: a callback has thrown");
    }
}

}  // namespace splitcubes::api
