#include <splitcubes/core/parallel.h>
#include <splitcubes/core/sanitizers.h>

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cassert>
#include <thread>
#if defined(SPLITCUBES_THREAD_SANITIZER)
#include <exception>
#include <mutex>
#endif

namespace splitcubes {

#if defined(SPLITCUBES_THREAD_SANITIZER)
namespace {
// ThreadSanitizer cannot see the synchronisation inside the packaged TBB and would
// report races that are none. In its builds plain threads take the chunks instead.
void run_on_threads(int thread_count, std::size_t chunk_count,
                    const std::function<void(std::size_t)>& run_chunk) {
    std::atomic<std::size_t> next{0};
    std::exception_ptr error;
    std::mutex error_mutex;
    const auto work = [&] {
        try {
            for (std::size_t chunk = next++; chunk < chunk_count; chunk = next++) run_chunk(chunk);
        } catch (...) {
            const std::lock_guard lock(error_mutex);
            if (!error) error = std::current_exception();
        }
    };
    std::vector<std::thread> threads;
    for (int k = 1; k < thread_count; ++k) threads.emplace_back(work);
    work();
    for (std::thread& thread : threads) thread.join();
    if (error) std::rethrow_exception(error);
}
}  // namespace
#endif

struct Parallel::Pool {
    explicit Pool(int threads)
        : control(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads)),
          arena(threads),
          thread_count(threads) {}
    // Lets an arena be larger than the machine, so that determinism can be tried
    // with more threads than cores.
    tbb::global_control control;
    tbb::task_arena arena;
    int thread_count;
    Monitor* monitor = nullptr;
};

Parallel::Parallel(int thread_count)
    : pool_(std::make_unique<Pool>(
          thread_count > 0 ? thread_count
                           : std::max(1, static_cast<int>(std::thread::hardware_concurrency())))) {}
Parallel::~Parallel() = default;
Parallel::Parallel(Parallel&&) noexcept = default;
Parallel& Parallel::operator=(Parallel&&) noexcept = default;

int Parallel::thread_count() const {
    return pool_->thread_count;
}

void Parallel::watch(Monitor* monitor) {
    pool_->monitor = monitor;
}

void Parallel::check() const {
    if (pool_->monitor && pool_->monitor->cancelled()) throw Cancelled();
}

void Parallel::begin(const std::string& stage) const {
    check();
    if (pool_->monitor) pool_->monitor->begin(stage);
}

void Parallel::for_chunks(std::size_t count, std::size_t grain,
                          const std::function<void(std::size_t, std::size_t)>& body) const {
    assert(grain > 0);
    const std::size_t chunk_count = (count + grain - 1) / grain;
    std::atomic<std::size_t> done{0};
    const auto run_chunk = [&](std::size_t chunk) {
        check();
        body(chunk * grain, std::min(count, (chunk + 1) * grain));
        if (pool_->monitor) pool_->monitor->advance(++done, chunk_count);
    };
    if (chunk_count <= 1 || pool_->thread_count == 1) {
        for (std::size_t chunk = 0; chunk < chunk_count; ++chunk) run_chunk(chunk);
        return;
    }
#if defined(SPLITCUBES_THREAD_SANITIZER)
    run_on_threads(pool_->thread_count, chunk_count, run_chunk);
#else
    pool_->arena.execute(
        [&] { tbb::parallel_for(std::size_t{0}, chunk_count, run_chunk, tbb::simple_partitioner{}); });
#endif
}

}  // namespace splitcubes
