#include "background_stream.hpp"

#include <array>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <mutex>
#include <streambuf>
#include <thread>
#include <vector>

namespace cie::viewer_export {
namespace {

constexpr std::size_t kBlocks = 8;
constexpr std::size_t kBlockSize = 1U << 18U;

// Thrown through the thread in the background when what it hands on is no longer wanted.
struct Abandoned {};

}  // namespace

// Blocks going round between the thread that fills them and the one that hands them on.
class BackgroundStream::Buffer final : public std::streambuf {
 public:
  explicit Buffer(std::ostream& out) : out_(out) {
    for (auto& block : blocks_)
      block.bytes.resize(kBlockSize);
    begin_block();
    // Nothing may fail once it runs: it ends when it is told to.
    thread_ = std::jthread([this] { hand_on(); });
  }
  ~Buffer() override {
    {
      const std::scoped_lock lock(mutex_);
      is_abandoned_ = true;
    }
    changed_.notify_all();
  }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;

  void finish() {
    end_block(true);
    thread_.join();
    if (error_) std::rethrow_exception(error_);
  }

 protected:
  int_type overflow(int_type c) override {
    end_block(false);
    begin_block();
    if (!traits_type::eq_int_type(c, traits_type::eof())) {
      *pptr() = traits_type::to_char_type(c);
      pbump(1);
    }
    return traits_type::not_eof(c);
  }

 private:
  struct Block {
    std::vector<char> bytes;
    std::size_t size = 0;
    bool is_last = false;
  };

  // Waits for a block that is free.
  void begin_block() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return filled_ - handed_on_ < kBlocks || error_; });
    if (error_) std::rethrow_exception(error_);
    auto& bytes = blocks_[filled_ % kBlocks].bytes;
    setp(bytes.data(), bytes.data() + bytes.size());
  }
  void end_block(bool is_last) {
    {
      const std::scoped_lock lock(mutex_);
      auto& block = blocks_[filled_ % kBlocks];
      block.size = static_cast<std::size_t>(pptr() - pbase());
      block.is_last = is_last;
      ++filled_;
    }
    changed_.notify_all();
  }

  // The other thread.
  void hand_on() noexcept {
    try {
      for (bool is_last = false; !is_last;) {
        const auto& block = next_block();
        is_last = block.is_last;
        out_.write(block.bytes.data(), static_cast<std::streamsize>(block.size));
        {
          const std::scoped_lock lock(mutex_);
          ++handed_on_;
        }
        changed_.notify_all();
      }
    } catch (const Abandoned&) {  // nobody waits for anything
    } catch (...) {
      const std::scoped_lock lock(mutex_);
      error_ = std::current_exception();
      changed_.notify_all();
    }
  }
  const Block& next_block() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return handed_on_ < filled_ || is_abandoned_; });
    if (is_abandoned_) throw Abandoned{};
    return blocks_[handed_on_ % kBlocks];
  }

  std::ostream& out_;
  std::array<Block, kBlocks> blocks_;

  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::size_t filled_ = 0;     // blocks, all in all
  std::size_t handed_on_ = 0;  // of them
  std::exception_ptr error_;
  bool is_abandoned_ = false;

  std::jthread thread_;  // last: it uses the rest
};

BackgroundStream::BackgroundStream(std::ostream& out)
    : buffer_(std::make_unique<Buffer>(out)),
      stream_(std::make_unique<std::ostream>(buffer_.get())) {
  stream_->exceptions(std::ios::badbit | std::ios::failbit);
}
BackgroundStream::~BackgroundStream() = default;

void BackgroundStream::finish() { buffer_->finish(); }

}  // namespace cie::viewer_export
