#include "archetypes.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace example {
namespace {

std::int64_t now_ns() {
  return std::chrono::nanoseconds{std::chrono::system_clock::now().time_since_epoch()}.count();
}

}  // namespace

Output::Output(cie::Node& node, const Place& place, const std::string& topic,
               std::uint32_t payload_bytes)
    : publisher_(node.create_publisher<Sample>(topic, place.queue_depth)),
      message_(cie::make_message<Sample>()) {
  cie::set_text(message_->frame_id, node.fully_qualified_name());
  cie::resize(message_->payload, payload_bytes);
}

void Output::publish(std::int64_t stamp) {
  message_->stamp = stamp;
  publisher_->publish(*message_);
  ++message_->seq;
}

Input::Input(cie::Node& node, const Place& place, const std::string& topic, Function function)
    : function_(std::move(function)),
      subscription_(node.create_subscription<Sample>(
          topic, place.queue_depth, [this](const Sample& sample) { on_sample(sample); })) {}

void Input::on_sample(const Sample& sample) {
  if (received_ > 0 && sample.seq > next_) missed_ += sample.seq - next_;
  next_ = sample.seq + 1;
  ++received_;
  function_(sample);
}

Sensor::Sensor(const Place& place, const std::string& name, std::chrono::milliseconds period,
               std::chrono::milliseconds phase, const std::string& output,
               std::uint32_t payload_bytes, Work work)
    : ExampleNode(place.context, name, place.name_space),
      work_(work),
      output_(node(), place, output, payload_bytes) {
  cie::TimerOptions options;
  options.phase = phase;
  timer_ = node().create_wall_timer(
      period,
      [this] {
        const std::int64_t stamp = now_ns();
        work_();
        output_.publish(stamp);
      },
      options);
}

Transform::Transform(const Place& place, const std::string& name, const std::string& input,
                     const std::string& output, std::uint32_t payload_bytes, Work work,
                     Input::Function on_done)
    : ExampleNode(place.context, name, place.name_space),
      work_(work),
      output_(node(), place, output, payload_bytes),
      on_done_(std::move(on_done)),
      input_(node(), place, input, [this](const Sample& sample) {
        work_();
        output_.publish(sample.stamp);
        if (on_done_) on_done_(sample);
      }) {}

Fusion::Fusion(const Place& place, const std::string& name,
               const std::array<std::string, 2>& inputs, const std::string& output,
               std::uint32_t payload_bytes, Work work)
    : ExampleNode(place.context, name, place.name_space),
      work_(work),
      output_(node(), place, output, payload_bytes) {
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    inputs_.push_back(std::make_unique<Input>(
        node(), place, inputs[i], [this, i](const Sample& sample) { on_input(i, sample); }));
  }
}

void Fusion::on_input(std::size_t index, const Sample& sample) {
  std::int64_t oldest = 0;
  {
    const std::lock_guard lock{mutex_};
    stamps_[index] = sample.stamp;
    oldest = std::ranges::min(stamps_);
    if (oldest == 0) return;
    stamps_ = {};
  }
  work_();
  const std::lock_guard lock{mutex_};
  output_.publish(oldest);
}

Intersection::Intersection(const Place& place, const std::string& name,
                           const std::array<Path, 2>& paths, std::uint32_t payload_bytes, Work work)
    : ExampleNode(place.context, name, place.name_space), work_(work) {
  for (const Path& path : paths) {
    outputs_.push_back(std::make_unique<Output>(node(), place, path.output, payload_bytes));
    inputs_.push_back(std::make_unique<Input>(
        node(), place, path.input, [this, &output = *outputs_.back()](const Sample& sample) {
          work_();
          output.publish(sample.stamp);
        }));
  }
}

bool Intersection::is_connected() const {
  return std::ranges::all_of(outputs_, [](const auto& output) { return output->has_readers(); });
}

Cyclic::Cyclic(const Place& place, const std::string& name, std::chrono::milliseconds period,
               const std::vector<std::string>& inputs, const std::string& output,
               std::uint32_t payload_bytes, Work work, std::function<void()> on_cycle)
    : ExampleNode(place.context, name, place.name_space),
      work_(work),
      output_(node(), place, output, payload_bytes),
      stamps_(inputs.size()),
      on_cycle_(std::move(on_cycle)) {
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    inputs_.push_back(
        std::make_unique<Input>(node(), place, inputs[i], [this, i](const Sample& sample) {
          const std::lock_guard lock{mutex_};
          stamps_[i] = sample.stamp;
        }));
  }
  timer_ = node().create_wall_timer(period, [this] { on_timer(); });
}

void Cyclic::on_timer() {
  if (on_cycle_) on_cycle_();
  std::int64_t oldest = std::numeric_limits<std::int64_t>::max();
  {
    const std::lock_guard lock{mutex_};
    for (const std::int64_t stamp : stamps_) {
      if (stamp != 0) oldest = std::min(oldest, stamp);
    }
  }
  work_();
  output_.publish(oldest);
}

Command::Command(const Place& place, const std::string& name, const std::string& input, Work work)
    : ExampleNode(place.context, name, place.name_space),
      work_(work),
      input_(node(), place, input, [this](const Sample&) { work_(); }) {}

}  // namespace example
