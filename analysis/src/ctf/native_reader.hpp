// Reads CTF 1.8 traces without help: finds their files, merges their streams by time.
#pragma once

#include <cie/analysis/progress.hpp>

#include "ctf/program/event_choice.hpp"
#include "ctf/stream/event_writer.hpp"
#include "vocabulary/translator.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>

namespace cie::analysis::ctf {

// Receives events in order of time; what they view is valid during the call.
using EventSink = std::function<void(const Event&)>;
// The same, many at a time.
using BatchSink = std::function<void(const EventBatch&)>;

struct ReadOptions {
  // What to read traces with whose own metadata cannot be read; empty: nothing.
  std::filesystem::path metadata_from{};
  Progress* progress = nullptr;  // bytes; borrowed, null: nobody looks
  // Says what follows from events whose meaning depends on earlier ones. Borrowed, null: they are
  // OtherEvents alone.
  Translator* translator = nullptr;
  // Wants events themselves: those that it does not want are OtherEvents of no class. Borrowed,
  // null: what vocabularies make of events is told.
  EventChoice* choice = nullptr;
  // Packets outside it are told without their events.
  TimeWindow window{};
  // Whether OtherEvents of no class are only counted: at its end, a packet has one that stands for
  // them all. Those of snapshots, which begin within a packet, are told one by one.
  bool counts_others = false;
};

// Reads traces once, in two parts, each of which throws UnreadableTrace: when metadata cannot be
// read, and when nothing can. Events are merged by time; equal times in an order that depends on the
// traces alone, not on names or order of files. What cannot be read of a trace is told as
// DamagedPacket, Discarded and TimeRegression. A trace that is read with another's metadata is told
// as a DamagedPacket of all of it.
class TraceReader {
 public:
  // Finds their streams. What `options` refers to is borrowed.
  explicit TraceReader(std::span<const std::filesystem::path> traces,
                       const ReadOptions& options = {});
  ~TraceReader();
  TraceReader(const TraceReader&) = delete;
  TraceReader& operator=(const TraceReader&) = delete;

  std::uint64_t bytes() const noexcept;  // of the streams' files
  // Feeds everything to `sink`. Packets are held whole as far as there is memory, to be read once.
  void read(const BatchSink& sink);
  // The same into batches for another core, which begin empty. The last one is passed on as well.
  // Packets are held in pieces: to read a whole one takes longer than the other core has batches.
  void read(EventBatch& first, const EventWriter::Exchange& exchange);
  // Does a part of what that will have to do, which `exchange` may ask for while it cannot give a batch.
  // False: there is no such part now.
  bool scan_ahead();

 private:
  class Streams;
  std::unique_ptr<Streams> streams_;
};

void read_traces(std::span<const std::filesystem::path> traces, const EventSink& sink,
                 const ReadOptions& options = {});

}  // namespace cie::analysis::ctf
