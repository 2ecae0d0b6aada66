import sys, json, pathlib, traceback
sys.path.insert(0, '.')
from oracle import difference, scenarios
from recompute import recompute
names=sys.argv[2:] or list(scenarios.ALL)
bad=0
for name in names:
  for seed in range(int(sys.argv[1])):
    d=pathlib.Path('/tmp/orc')/f'{name}-{seed}'
    try:
        scenarios.generate(name, seed, d)
        how=json.load(open(d/'how.json'))
        if not how['recomputable']: continue
        r=recompute([str(d/'trace')], str(d/'spec.yaml'))
    except Exception:
        print(name, seed); traceback.print_exc(limit=-4); bad+=1; continue
    lines=[]
    if how['numbers']:
        lines += difference.compare(json.load(open(d/'report.json')), r['report'])[:10]
        lines += difference.compare_text((d/'instances.csv').read_text(), r['instances'],'csv')
    v=difference.compare_verdicts(json.load(open(d/'verify.json')), r['verify'])
    lines += difference.compare_weaker(json.load(open(d/'verify.json')), r['verify']) if how['weaker'] else v
    if lines:
        print(name, seed); bad+=1
        for l in lines[:12]: print('    ',l)
print('bad', bad)
