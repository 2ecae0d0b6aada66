# Refuses versions of Cyclone DDS that were not tried. delivery.cpp and message_data.cpp pass samples through a
# cache and a type of their own, by interfaces that libddsc exports but does not promise: another version
# may work, and must be tried first.
#   0.10.2  Debian 12: the whole test suite
#   0.10.5  Debian 13: it builds unchanged, and the demo passes
# The headers that those two files include differ, between the two, in a comment and in a last member of
# nn_rdata that debug builds have; ours only reads the others, through pointers. Versions that lie between them are
# accepted for that, and were not tried by themselves.
if(CycloneDDS_VERSION VERSION_LESS 0.10.2 OR CycloneDDS_VERSION VERSION_GREATER 0.10.5)
  message(FATAL_ERROR "cie needs Cyclone DDS 0.10.2 to 0.10.5 (Debian 12 and 13: cyclonedds-dev), found "
    "${CycloneDDS_VERSION}. See executor/README.md, \"Arrival\" and \"Pointers\".")
endif()
