#include "feeler/planner/arrays/shared_pool.h"

#define XXH_INLINE_ALL
#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <unistd.h>
#include <xxhash.h>

#include <atomic>
#include <cerrno>
#include <system_error>
#include <utility>

namespace feeler::planner {
namespace {

constexpr std::uint64_t kPoolMagic = 0x3130'4c4f'4f50'4546;  // "FEPOOL01"
constexpr std::size_t kSlots = std::size_t{1} << 16;
/// A key is looked for in so many slots from its own on.
constexpr std::size_t kProbes = 64;
constexpr std::uint64_t kPlaces = 64;

enum State : std::uint32_t { kEmpty, kBeingWritten, kReady };

std::uint64_t PlaceAfter(std::uint64_t at) { return (at + kPlaces - 1) / kPlaces * kPlaces; }

/// All of it, or false with what the filesystem says no to.
bool WriteAt(int descriptor, std::span<const std::uint8_t> bytes, std::uint64_t at) {
  while (!bytes.empty()) {
    const ssize_t written = pwrite(descriptor, bytes.data(), bytes.size(), static_cast<off_t>(at));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(written));
    at += static_cast<std::uint64_t>(written);
  }
  return true;
}

bool FileLock(int descriptor, int how) {
  int result = 0;
  do {
    result = flock(descriptor, how);
  } while (result != 0 && errno == EINTR);
  return result == 0;
}

}  // namespace

struct SharedPool::Head {
  std::uint64_t magic;
  std::uint64_t next;  ///< where the next array goes
};

struct SharedPool::Slot {
  std::uint32_t state;
  Key key;
  std::uint64_t at;
  std::uint64_t size;
};

namespace {

constexpr std::uint64_t kTableBytes = std::uint64_t{kSlots} * 64;

}  // namespace

std::shared_ptr<SharedPool> SharedPool::Open(const std::filesystem::path& file, std::uint64_t most_bytes) {
  static_assert(sizeof(Head) + kSlots * sizeof(Slot) <= kTableBytes);
  static_assert(std::atomic_ref<std::uint32_t>::is_always_lock_free &&
                std::atomic_ref<std::uint64_t>::is_always_lock_free);
  std::error_code ignored;
  std::filesystem::create_directories(file.parent_path(), ignored);
  const int descriptor = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor < 0) return nullptr;
  const bool first = FileLock(descriptor, LOCK_EX | LOCK_NB);
  // The room of the table is taken from the disk now: a page that cannot be had later would kill the process.
  const bool begun =
      !first || (ftruncate(descriptor, 0) == 0 && posix_fallocate(descriptor, 0, static_cast<off_t>(kTableBytes)) == 0);
  if (begun && first) {
    const Head head{kPoolMagic, kTableBytes};
    const bool written = WriteAt(descriptor, {reinterpret_cast<const std::uint8_t*>(&head), sizeof(head)}, 0);
    if (!written) (void)ftruncate(descriptor, 0);
  }
  void* table = MAP_FAILED;
  void* arrays = MAP_FAILED;
  if (begun && FileLock(descriptor, LOCK_SH) && lseek(descriptor, 0, SEEK_END) >= static_cast<off_t>(kTableBytes)) {
    table = mmap(nullptr, kTableBytes, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
    arrays = mmap(nullptr, most_bytes, PROT_READ, MAP_SHARED | MAP_NORESERVE, descriptor, 0);
  }
  if (table != MAP_FAILED && arrays != MAP_FAILED && static_cast<const Head*>(table)->magic == kPoolMagic) {
    return std::shared_ptr<SharedPool>(new SharedPool(file, descriptor, most_bytes, table, arrays));
  }
  if (table != MAP_FAILED) munmap(table, kTableBytes);
  if (arrays != MAP_FAILED) munmap(arrays, most_bytes);
  close(descriptor);
  return nullptr;
}

SharedPool::SharedPool(std::filesystem::path file, int descriptor, std::uint64_t most_bytes, void* table, void* arrays)
    : file_(std::move(file)), descriptor_(descriptor), most_bytes_(most_bytes), table_(table), arrays_(arrays) {}

SharedPool::~SharedPool() {
  munmap(table_, kTableBytes);
  munmap(arrays_, most_bytes_);
  if (FileLock(descriptor_, LOCK_EX | LOCK_NB)) unlink(file_.c_str());  // nobody else has it
  close(descriptor_);
}

std::span<SharedPool::Slot> SharedPool::Slots() const {
  return {reinterpret_cast<Slot*>(static_cast<std::byte*>(table_) + sizeof(Head)), kSlots};
}

std::span<const std::uint8_t> SharedPool::ArrayOf(const Slot& slot) const {
  return {static_cast<const std::uint8_t*>(arrays_) + slot.at, slot.size};
}

std::span<const std::uint8_t> SharedPool::Find(const Key& key) const {
  const std::size_t begin = XXH3_64bits(key.data(), sizeof(key)) % kSlots;
  for (std::size_t probe = 0; probe < kProbes; ++probe) {
    Slot& slot = Slots()[(begin + probe) % kSlots];
    const std::uint32_t state = std::atomic_ref(slot.state).load(std::memory_order_acquire);
    if (state == kEmpty) return {};
    if (state == kReady && slot.key == key && slot.size > 0) return ArrayOf(slot);
  }
  return {};
}

std::span<const std::uint8_t> SharedPool::Keep(const Key& key, std::span<const std::uint8_t> bytes) {
  const std::size_t begin = XXH3_64bits(key.data(), sizeof(key)) % kSlots;
  for (std::size_t probe = 0; probe < kProbes; ++probe) {
    Slot& slot = Slots()[(begin + probe) % kSlots];
    const std::atomic_ref state(slot.state);
    std::uint32_t expected = kEmpty;
    if (!state.compare_exchange_strong(expected, kBeingWritten, std::memory_order_acq_rel)) {
      if (expected == kReady && slot.key == key && slot.size > 0) return ArrayOf(slot);  // another was faster
      continue;
    }
    slot.key = key;
    slot.size = 0;  // what cannot be kept
    const std::atomic_ref next(static_cast<Head*>(table_)->next);
    const std::uint64_t needed = PlaceAfter(bytes.size());
    const std::uint64_t at = next.fetch_add(needed, std::memory_order_relaxed);
    if (at <= most_bytes_ && needed <= most_bytes_ - at && WriteAt(descriptor_, bytes, at)) {
      slot.at = at;
      slot.size = bytes.size();
    }
    state.store(kReady, std::memory_order_release);
    return slot.size > 0 ? ArrayOf(slot) : std::span<const std::uint8_t>();
  }
  return {};
}

}  // namespace feeler::planner
