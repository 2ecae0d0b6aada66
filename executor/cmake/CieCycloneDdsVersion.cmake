# The versions of Cyclone DDS that cie was tried with, and how. Sources of ours pass samples through a cache and a type
# of their own, by interfaces that libddsc exports but does not promise. CieCycloneDdsInterfaces.cmake tests that they
# are there; what they do, only a trial tells.
set(tried
  "0.10.2: Debian 12, the whole test suite"
  "0.10.3: its interfaces alone, which are the same"
  "0.10.4: Ubuntu 24.04, the whole test suite"
  "0.10.5: Debian 13, the whole test suite, and its interfaces alone as ROS 2 Humble and Jazzy have it")

list(JOIN tried "\n  " CIE_CYCLONEDDS_ADVICE)
string(CONCAT CIE_CYCLONEDDS_ADVICE "cie was tried with these versions of Cyclone DDS:\n  ${CIE_CYCLONEDDS_ADVICE}\n"
  "Debian 12 and 13 and Ubuntu 24.04 have one of them (cyclonedds-dev), ROS 2 Humble and Jazzy too (-DCIE_CYCLONEDDS_OF_ROS=ON); "
  "-DCycloneDDS_DIR=… names another. To try another version: -DCIE_CYCLONEDDS_UNTRIED=ON, then ./run test.")
string(REGEX REPLACE ":[^;]*" "" tried "${tried}")
list(FIND tried "${CycloneDDS_VERSION}" found)
if(found EQUAL -1)
  if(NOT CIE_CYCLONEDDS_UNTRIED)
    message(FATAL_ERROR "Cyclone DDS ${CycloneDDS_VERSION} was not tried. ${CIE_CYCLONEDDS_ADVICE}")
  endif()
  message(WARNING "Cyclone DDS ${CycloneDDS_VERSION} was not tried. What it does is for the tests to say.")
endif()
