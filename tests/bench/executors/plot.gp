# Draws the file of all numbers that cie-bench-executors writes, in the style of the paper's figure:
#   gnuplot -e "csv='executors.csv'; svg='executors.svg'; policy='fifo'; phases='staggered'" plot.gp
set datafile separator ','
set datafile missing NaN
set terminal svg size 1150,1150 font 'sans-serif,13' background rgb 'white'
set output svg
colours = '#d62728 #1f77b4 #7fb3d9 #2ca02c #98d17f #ff9896 #9467bd'
executors = 'isolated single single-waitset multi multi-waitset isolated-waitset events'
set multiplot layout 4,2 title sprintf('SCHED %s, phases %s', policy, phases) font ',15'
set grid ytics back lt 1 lw 0.5 lc rgb '#d0d0d0'
set border 3 lc rgb '#808080'
set tics nomirror
set xlabel 'N timers of 10 ms, N subscriptions'
set xtics (1, 4, 8, 12, 16, 20, 24)
set xrange [0:25]
set yrange [0:*]
# Columns: 1 executor, 2 policy, 3 path, 4 phases, 7 N, 8 seconds, 10 system calls, 11 context
# switches, 13 PSS, 16 p99.
is_row(e, path) = strcol(1) eq e && strcol(2) eq policy && strcol(3) eq path && strcol(4) eq phases
rate(e, path, c) = is_row(e, path) ? column(c) / column(8) : NaN
level(e, path, c) = is_row(e, path) ? column(c) : NaN
do for [metric in '10 11 13 16'] {
  c = int(metric)
  name = c == 10 ? 'system calls per second' : c == 11 ? 'context switches per second' \
       : c == 13 ? 'memory (PSS), MiB' : 'publish to callback, p99, us'
  do for [path in 'intra inter'] {
    set title path.': '.name
    if (path eq 'inter') { set key outside right top samplen 2 font ',10' } else { unset key }
    if (c == 10 || c == 11) {
      plot for [i=1:words(executors)] csv \
        using 7:(rate(word(executors, i), path, c)) with linespoints lw (i == 1 ? 2.5 : 1.5) pt i ps 0.6 \
        lc rgb word(colours, i) \
        title word(executors, i) noenhanced
    } else {
      scale = c == 13 ? 1024.0 : 1.0
      plot for [i=1:words(executors)] csv \
        using 7:(level(word(executors, i), path, c) / scale) with linespoints lw (i == 1 ? 2.5 : 1.5) pt i ps 0.6 \
        lc rgb word(colours, i) \
        title word(executors, i) noenhanced
    }
  }
}
unset multiplot
