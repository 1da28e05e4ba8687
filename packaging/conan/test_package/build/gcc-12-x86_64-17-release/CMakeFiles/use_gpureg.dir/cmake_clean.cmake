file(REMOVE_RECURSE
  "CMakeFiles/use_gpureg.dir/use_gpureg.cpp.o"
  "CMakeFiles/use_gpureg.dir/use_gpureg.cpp.o.d"
  "use_gpureg"
  "use_gpureg.pdb"
)

# Per-language clean rules from dependency scanning.
foreach(lang CXX)
  include(CMakeFiles/use_gpureg.dir/cmake_clean_${lang}.cmake OPTIONAL)
endforeach()
