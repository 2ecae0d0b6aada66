// Bare LTTng-UST tracepoints with the payloads of the hot events: what the facade is compared with.
#pragma GCC system_header

#undef LTTNG_UST_TRACEPOINT_PROVIDER
#define LTTNG_UST_TRACEPOINT_PROVIDER cie_bare

#undef LTTNG_UST_TRACEPOINT_INCLUDE
#define LTTNG_UST_TRACEPOINT_INCLUDE "./provider.h"

#if !defined(CIE_BENCH_PROVIDER_H) || defined(LTTNG_UST_TRACEPOINT_HEADER_MULTI_READ)
#define CIE_BENCH_PROVIDER_H

#ifndef LTTNG_UST_TRACEPOINT_HIDDEN_DEFINITION
#define LTTNG_UST_TRACEPOINT_HIDDEN_DEFINITION
#define LTTNG_UST_TRACEPOINT_PROVIDER_HIDDEN_DEFINITION
#endif

#include <cstdint>

#include <lttng/tracepoint.h>

// clang-format off
LTTNG_UST_TRACEPOINT_EVENT(cie_bare, callback_release,
  LTTNG_UST_TP_ARGS(std::uint32_t, id, std::uint64_t, seq, std::uint64_t, overwritten_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer(std::uint32_t, callback_id, id)
    lttng_ust_field_integer(std::uint64_t, release_seq, seq)
    lttng_ust_field_integer(std::uint64_t, overwritten, overwritten_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(cie_bare, thread_wakeup,
  LTTNG_UST_TP_ARGS(std::uint32_t, id, std::uint8_t, reason_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer(std::uint32_t, callback_id, id)
    lttng_ust_field_integer(std::uint8_t, reason, reason_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(cie_bare, callback_start,
  LTTNG_UST_TP_ARGS(std::uint32_t, id, std::uint64_t, seq_, std::uint8_t, kind, std::int64_t, release,
                    std::uint32_t, missed_, std::int64_t, source, std::uint64_t, gid),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer(std::uint32_t, callback_id, id)
    lttng_ust_field_integer(std::uint64_t, seq, seq_)
    lttng_ust_field_integer(std::uint8_t, release_kind, kind)
    lttng_ust_field_integer(std::int64_t, release_ns, release)
    lttng_ust_field_integer(std::uint32_t, missed, missed_)
    lttng_ust_field_integer(std::int64_t, source_timestamp_realtime_ns, source)
    lttng_ust_field_integer(std::uint64_t, writer_gid, gid)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(cie_bare, callback_end,
  LTTNG_UST_TP_ARGS(std::uint32_t, id, std::uint64_t, seq_, std::uint8_t, status_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer(std::uint32_t, callback_id, id)
    lttng_ust_field_integer(std::uint64_t, seq, seq_)
    lttng_ust_field_integer(std::uint8_t, status, status_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(cie_bare, publish,
  LTTNG_UST_TP_ARGS(std::uint32_t, id, std::uint64_t, seq_, std::int64_t, source),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer(std::uint32_t, publisher_id, id)
    lttng_ust_field_integer(std::uint64_t, seq, seq_)
    lttng_ust_field_integer(std::int64_t, source_timestamp_realtime_ns, source)
  )
)
// clang-format on

#endif  // CIE_BENCH_PROVIDER_H

#include <lttng/tracepoint-event.h>
