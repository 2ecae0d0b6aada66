// Messages inside Cyclone DDS: by pointer within the process, as bytes between processes.
#pragma once

#include "message_layout.hpp"

#include <memory>

struct ddsi_serdata;
struct ddsi_sertype;

namespace cie::executor {

// A type for dds_create_topic_sertype() whose samples may be a pointer to a message that a
// publisher of this process handed over. Readers of the process get that pointer; bytes are made of
// it when somebody else needs them, once. What comes from elsewhere stays bytes, checked and in
// this machine's byte order, until it is taken, on the thread that takes it. Returns one reference.
//
// Null when the layout is not plain, or when built with CIE_MESSAGES_BY_POINTER=OFF
// (no_message_data.cpp): then Cyclone's own serialisation does it. These are interfaces that
// libddsc exports but does not promise; the build asks for versions that were tried.
::ddsi_sertype* make_pointer_type(LayoutPtr layout);

// A sample of such a type for dds_forwardcdr(): one reference; its timestamp is the caller's to
// set. Null without memory.
::ddsi_serdata* make_message_data(const ::ddsi_sertype& type,
                                  std::shared_ptr<const void> message) noexcept;

// The message a sample points to; null when it has bytes only, or is of another kind of type.
std::shared_ptr<const void> message_of(const ::ddsi_serdata& sample) noexcept;

// Whether bytes were wanted of the sample's message, and it has a value that its type forbids.
bool is_refused(const ::ddsi_serdata& sample) noexcept;

// Whether it came as bytes and with a text that no message can hold: one with a zero inside. Such a
// sample must not be converted, because its text would be cut there. Looks through all texts: for
// who is about to convert it, not for who receives it.
bool is_unreadable(const ::ddsi_serdata& sample) noexcept;

}  // namespace cie::executor
