// Reads CTF 1.8 traces without help: finds their files, merges their streams by time.
#pragma once

#include <cie/analysis/progress.hpp>

#include "ctf/program/event_choice.hpp"
#include "ctf/stream/event_writer.hpp"
#include "vocabulary/ros2/event_translator.hpp"

#include <filesystem>
#include <functional>
#include <span>

namespace cie::analysis::ctf {

// Receives events in order of time; what they view is valid during the call.
using EventSink = std::function<void(const Event&)>;

struct ReadOptions {
  // What to read traces with whose own metadata cannot be read; empty: nothing.
  std::filesystem::path metadata_from{};
  Progress* progress = nullptr;  // bytes; borrowed, null: nobody looks
  // Says what follows from events whose meaning depends on earlier ones. Borrowed, null: they are
  // OtherEvents alone.
  EventTranslator* translator = nullptr;
  // Wants events themselves: those that it does not want are OtherEvents of no class. Borrowed,
  // null: what vocabularies make of events is told.
  EventChoice* choice = nullptr;
  // Packets outside it are told without their events.
  TimeWindow window{};
  // Whether OtherEvents of no class are only counted: at its end, a packet has one that stands for
  // them all. Those of snapshots, which begin within a packet, are told one by one.
  bool counts_others = false;
};

// Feeds everything to `sink`, merged by time; equal times in an order that depends on the traces
// alone, not on names or order of files. What cannot be read of a trace is told as DamagedPacket,
// Discarded and TimeRegression. Throws UnreadableTrace when metadata cannot be read, or nothing
// can. A trace that is read with another's metadata is told as a DamagedPacket of all of it.
void read_traces(std::span<const std::filesystem::path> traces, const EventSink& sink,
                 const ReadOptions& options = {});

// The same into batches, which begin empty. The last one is passed on as well.
void read_batches(std::span<const std::filesystem::path> traces, EventBatch& first,
                  const EventWriter::Exchange& exchange, const ReadOptions& options);

}  // namespace cie::analysis::ctf
