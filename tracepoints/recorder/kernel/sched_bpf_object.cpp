// The compiled BPF programs within the recorder, so that it needs no file beside it.
asm(R"(
  .pushsection .rodata
  .balign 8
  .global cie_sched_bpf_begin
  .global cie_sched_bpf_end
cie_sched_bpf_begin:
  .incbin ")" CIE_SCHED_BPF_OBJECT R"("
cie_sched_bpf_end:
  .popsection
)");
