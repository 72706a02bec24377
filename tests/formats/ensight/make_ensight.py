# Writes the files of this folder. `make_ensight.py plain` leaves ids out, as VTK 9.1 cannot read those of grids.
import struct,sys
ids=sys.argv[1:]!=['plain']
class W:
    def __init__(s,path,kind,geo=False):
        s.f=open(path,'wb'); s.k=kind
        if geo and kind!='ascii': s.line('C Binary')
    def line(s,t): s.f.write((t+'\n').encode() if s.k=='ascii' else t.encode().ljust(80,b'\0'))
    def ints(s,v,per=1):
        if s.k=='ascii':
            for i in range(0,len(v),per): s.f.write(("".join("%10d"%x for x in v[i:i+per])+'\n').encode())
        else: s.f.write(struct.pack(('<' if s.k=='le' else '>')+'%di'%len(v),*v))
    def floats(s,v):
        if s.k=='ascii': s.f.write("".join("%12.5e\n"%x for x in v).encode())
        else: s.f.write(struct.pack(('<' if s.k=='le' else '>')+'%df'%len(v),*v))
def geo(w,step=0,extents=True):
    w.line('three parts'); w.line(''); w.line('node id given' if ids else 'node id off'); w.line('element id given' if ids else 'element id off')
    if extents:
        w.line('extents')
        if w.k=='ascii': w.f.write(b"%12.5e%12.5e\n"%(-1.,-2.)*3)
        else: w.floats([-1,-2]*3)
    w.line('part'); w.ints([1]); w.line('solid'); w.line('coordinates'); w.ints([6])
    if ids: w.ints([10,20,30,40,50,60])
    w.floats([0,1,0,0,1,0]); w.floats([0,0,1,0,0,1]); w.floats([0,0,0,1.5+step,1,1])
    w.line('tetra4'); w.ints([1])
    if ids: w.ints([7])
    w.ints([1,2,3,4],4)
    w.line('penta6'); w.ints([1])
    if ids: w.ints([9])
    w.ints([1,2,3,4,5,6],6)
    w.line('part'); w.ints([3]); w.line('grid of it'); w.line('block iblanked'); w.ints([2,3,2],3)
    w.floats([i%2+step for i in range(12)]); w.floats([i//2%3 for i in range(12)]); w.floats([i//6+10 for i in range(12)]); w.ints([1]*12)
    if ids: w.line('node_ids'); w.ints(list(range(101,113))); w.line('element_ids'); w.ints([201,202])
    w.line('part'); w.ints([4]); w.line('even'); w.line('block uniform'); w.ints([3,2,1],3); w.floats([5,6,7]); w.floats([.5,.25,1])
    if ids: w.line('node_ids'); w.ints(list(range(1,7))); w.line('element_ids'); w.ints([1,2])
def p(w,step):
    w.line('pressure'); w.line('part'); w.ints([1]); w.line('coordinates undef'); w.floats([-999.]); w.floats([0,1,-999.,3,4,5+step])
    w.line('part'); w.ints([3]); w.line('block'); w.floats([i+.5+step for i in range(12)])
def v(w,step):
    w.line('speed'); w.line('part'); w.ints([1]); w.line('penta6'); w.floats([1,2,3+step]); w.line('tetra4'); w.floats([4,5,6])
    w.line('part'); w.ints([4]); w.line('block'); w.floats([i+step for i in range(6)])
def case(name,kind,how):
    n=3
    if how=='stars':
        for s in range(n):
            geo(W('%s%03d.geo'%(name,s*5+2),kind,True),s); p(W('%s%03d.p'%(name,s*5+2),kind),s); v(W('%s%03d.v'%(name,s*5+2),kind),s)
        a=name+'***'; ts='1 '; fs=''
    elif how=='file':
        ws=[W(name+e,kind,e=='.geo') for e in('.geo','.p','.v')]
        for s in range(n):
            for w,fn in zip(ws,(geo,p,v)):
                w.line('BEGIN TIME STEP'); fn(w,s); w.line('END TIME STEP')
        a=name; ts='1 1 '
    else:
        geo(W(name+'.geo',kind,True)); p(W(name+'.p',kind),0); v(W(name+'.v',kind),0); a=name; ts=''
    c="# a comment\nFORMAT\ntype:  ensight gold\n\nGEOMETRY\nmodel: %s%s.geo\n\nVARIABLE\nconstant per case: gamma 1.4\nscalar per node: %sp %s.p\nvector per element: %sv %s.v\n"%(ts,a,ts,a,ts,a)
    if ts:
        c+="\nTIME\ntime set: 1 the only one\nnumber of steps: 3\nfilename start number: 2\nfilename increment: 5\ntime values: 0 0.5\n 2.25\n"
    if how=='file': c+="FILE\nfile set: 1\nnumber of steps: 3\n"
    open(name+'.case','w').write(c)
for k in('ascii','le','be'): case(k+'_file',k,'file')
case('le_stars','le','stars')

# Every element once, in text.
kinds={'point':1,'bar2':2,'bar3':3,'tria3':3,'tria6':6,'quad4':4,'quad8':8,'tetra4':4,'tetra10':10,'pyramid5':5,'pyramid13':13,'penta6':6,'penta15':15,'hexa8':8,'hexa20':20}
n=20
g="all kinds\nsecond line\nnode id off\nelement id off\npart\n%10d\nthe part\ncoordinates\n%10d\n"%(1,n)
for c in range(3):
    for i in range(n): g+="%12.5e\n"%(i*(c+1)+.25*c)
for k,m in kinds.items():
    g+="%s\n%10d\n"%(k,1)+"".join("%10d"%(i+1) for i in range(m))+"\n"
g+="nsided\n%10d\n%10d\n%10d\n"%(2,3,5)+"".join("%10d"%x for x in(1,2,3))+"\n"+"".join("%10d"%x for x in(4,5,6,7,8))+"\n"
g+="nfaced\n%10d\n%10d\n"%(1,4)+"%10d\n"*4%(3,3,3,3)+"".join("".join("%10d"%x for x in f)+"\n" for f in((1,3,2),(1,2,4),(2,3,4),(3,1,4)))
open("all.geo","w").write(g)
t="tensor\npart\n%10d\ncoordinates\n"%1
for c in range(6):
    for i in range(n): t+="%12.5e\n"%(c*100+i)
open("all.sym","w").write(t)
t="elem\npart\n%10d\n"%1
for j,k in enumerate(list(kinds)+['nsided','nfaced']):
    t+=k+"\n"
    for c in range(3):
        for i in range(2 if k=='nsided' else 1): t+="%12.5e\n"%(j*10+c+i*.5)
open("all.vec","w").write(t)
open("all.case","w").write("FORMAT\ntype: ensight gold\n\nGEOMETRY\nmodel: all.geo\n\nVARIABLE\ntensor symm per node: S all.sym\nvector per element: v all.vec\n")
