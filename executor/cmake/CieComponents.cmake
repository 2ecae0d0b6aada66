# cie_add_component(my_components talker.cpp listener.cpp ...)
#
# A shared object that `cie run` can load: libmy_components.so. Link what else it needs to the target.
include_guard(GLOBAL)

function(cie_add_component target)
  if(NOT ARGN)
    message(FATAL_ERROR "cie_add_component(${target}) needs source files")
  endif()
  add_library(${target} MODULE ${ARGN})
  target_link_libraries(${target} PRIVATE cie::executor)
  # GNU's unique symbols, which templates with static data become, would keep it loaded for ever.
  target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-fno-gnu-unique>)
endfunction()
