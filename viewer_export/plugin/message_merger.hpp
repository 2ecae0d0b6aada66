// Messages of several inputs as one sequence in order of time.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include <babeltrace2/babeltrace.h>

namespace cie::viewer_export {

class MessageMerger {
 public:
  // Takes over the iterator's reference.
  void add(bt_message_iterator* iterator);
  bool is_empty() const noexcept { return inputs_.empty(); }

  // Hands over what the inputs have ready, in order of time; the message is borrowed during the
  // call. The status is what the iterators said: more may come only after `ok`.
  bt_message_iterator_next_status next(const std::function<void(const bt_message*)>& take);

 private:
  struct PutIterator {
    void operator()(bt_message_iterator* iterator) const noexcept {
      bt_message_iterator_put_ref(iterator);
    }
  };
  struct PutMessage {
    void operator()(const bt_message* message) const noexcept { bt_message_put_ref(message); }
  };
  using MessageRef = std::unique_ptr<const bt_message, PutMessage>;
  struct Input {
    std::unique_ptr<bt_message_iterator, PutIterator> iterator;
    std::deque<MessageRef> ready;
    std::int64_t time = std::numeric_limits<std::int64_t>::min();  // of the first one ready
    bool has_ended = false;
  };

  static bt_message_iterator_next_status fill(Input& input);

  std::vector<Input> inputs_;
};

}  // namespace cie::viewer_export
