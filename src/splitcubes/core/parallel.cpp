#include <splitcubes/core/parallel.h>
#include <splitcubes/core/sanitizers.h>

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cassert>
#include <map>
#include <mutex>
#include <thread>
#if defined(SPLITCUBES_THREAD_SANITIZER)
#include <exception>
#endif

namespace splitcubes {

#if defined(SPLITCUBES_THREAD_SANITIZER)
namespace {
// ThreadSanitizer cannot see the synchronisation inside the packaged TBB and would report false races. Its
// builds use plain threads instead.
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
    class LoopProgress;
    std::string label() const {
        const int pass = passes.at(stage);
        return pass > 1 ? stage + ", pass " + std::to_string(pass) : stage;
    }
    // Allows an arena larger than the machine, so that determinism can be tested with more threads than
    // cores.
    tbb::global_control control;
    tbb::task_arena arena;
    int thread_count;
    Monitor* monitor = nullptr;
    std::string stage;
    std::map<std::string, int> passes;     // per stage: loops that reported progress
    std::atomic<bool> is_reported{false};  // a running loop reports progress
};

// Reports the progress of one loop to the monitor. Each loop of a stage but the first is a pass with its own
// name, so that progress under one name never decreases. Loops inside a loop report nothing.
class Parallel::Pool::LoopProgress {
  public:
    LoopProgress(Pool& pool, std::size_t total) : pool_(pool), total_(total) {
        constexpr std::size_t min_chunks = 8;  // loops of fewer chunks report nothing
        if (pool.monitor == nullptr || total < min_chunks) return;
        reports_ = !pool.is_reported.exchange(true);
        if (reports_ && pool.passes[pool.stage]++ > 0) pool.monitor->begin(pool.label());
    }
    ~LoopProgress() {
        if (reports_) pool_.is_reported = false;
    }
    LoopProgress(const LoopProgress&) = delete;
    LoopProgress& operator=(const LoopProgress&) = delete;

    // Called on any thread; the reported progress never decreases.
    void add() {
        if (!reports_) return;
        const std::lock_guard lock(mutex_);
        pool_.monitor->advance(++done_, total_);
    }

  private:
    Pool& pool_;
    std::size_t total_;
    bool reports_ = false;
    std::mutex mutex_;
    std::size_t done_ = 0;
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
    pool_->passes.clear();
    pool_->stage.clear();
}

void Parallel::check() const {
    if (pool_->monitor && pool_->monitor->cancelled()) throw Cancelled();
}

void Parallel::begin(const std::string& stage) const {
    check();
    if (!pool_->monitor) return;
    pool_->stage = stage;
    // A stage that begins again continues its count of passes.
    pool_->monitor->begin(pool_->passes[stage] == 0 ? stage : pool_->label());
}

void Parallel::for_chunks(std::size_t count, std::size_t grain,
                          const std::function<void(std::size_t, std::size_t)>& body) const {
    assert(grain > 0);
    const std::size_t chunk_count = (count + grain - 1) / grain;
    Pool::LoopProgress progress(*pool_, chunk_count);
    const auto run_chunk = [&](std::size_t chunk) {
        check();
        body(chunk * grain, std::min(count, (chunk + 1) * grain));
        progress.add();
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
