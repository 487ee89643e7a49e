// Xcos. run.py writes the case's numbers in front of this script: CASE, WIDTH, PAIRS, DELAYS, GAIN, CONSTANT, H, STEPS,
// REPEATS, CHECK_STEPS and, for the cart-pole, CART, POLE, LENGTH, GRAVITY, THETA, PERIOD, K.
mode(-1);
timer();
loadXcosLibs();
global scs_m;
scs_m = scicos_diagram();

function index = add(block)
    global scs_m;
    index = length(scs_m.objs) + 1;
    scs_m.objs(index) = block;
endfunction

// From output `from` of a block to input `to` of another; KIND 1 carries data, -1 events.
function connect(a, from, b, to, KIND)
    global scs_m;
    link = length(scs_m.objs) + 1;
    scs_m.objs(link) = scicos_link(xx=[0;1], yy=[0;1], ct=[1 KIND], from=[a from 0], to=[b to 1]);
    if KIND == 1 then
        scs_m.objs(a).graphics.pout(from) = link;
        scs_m.objs(b).graphics.pin(to) = link;
    else
        scs_m.objs(a).graphics.peout(from) = link;
        scs_m.objs(b).graphics.pein(to) = link;
    end
endfunction

// A block of the palette with the given texts of its parameters, which xcos_compile reads.
function index = block(name, parameters)
    b = evstr(name + "(""define"")");
    b.graphics.exprs = parameters;
    index = add(b);
endfunction

function t = text(values)
    t = "[" + strcat(msprintf("%.17g\n", values(:)), ";") + "]";
endfunction

// An event at 0, h, 2h, ...: a delay of h that triggers itself.
function index = ticks(h)
    index = block("EVTDLY_c", [text(h); "0"]);
    connect(index, 1, index, 1, -1);
endfunction

function index = gain(K)
    index = block("GAINBLK", [text(K) + "''"; "0"]);
endfunction

// signs of the inputs, +1 or -1; for a product, -1 divides
function index = sum_of(signs)
    index = block("SUMMATION", ["1"; text(signs); "0"]);
endfunction

function index = product(signs)
    index = block("PRODUCT", [text(signs); "0"]);
endfunction

function wire(from, to)
    for i = 1:length(to) / 2
        connect(from, 1, to(2 * i - 1), to(2 * i), 1);
    end
endfunction

function last = chain()
    one = block("CONST_m", text(CONSTANT * ones(WIDTH, 1)));
    tick = ticks(H);
    delays = [];
    for i = 1:DELAYS
        delays(i) = block("DOLLAR_f", [text(zeros(WIDTH, 1)); "0"]);
        connect(tick, 1, delays(i), 1, -1);
    end
    last = delays($);
    for i = 1:PAIRS
        scale = gain(GAIN);
        scm = sum_of([1; 1]);
        wire(last, [scale 1]);
        wire(scale, [scm 1]);
        wire(one, [scm 2]);
        last = scm;
    end
    from = last;
    for i = 1:DELAYS
        wire(from, [delays(i) 1]);
        from = delays(i);
    end
endfunction

function index = integrator(initial)
    index = block("INTEGRAL_m", [text(initial); "0"; "0"; "1"; "-1"]);
endfunction

function theta = cart_pole()
    p = integrator(0); theta = integrator(THETA); v = integrator(0); omega = integrator(0);
    s = block("TrigFun", "sin"); c = block("TrigFun", "cos");
    omega2 = product([1; 1]); l_omega2 = gain(LENGTH); g_cos = gain(GRAVITY); g_sin = gain(GRAVITY);
    pull = sum_of([1; -1]); s_pull = product([1; 1]); m_s_pull = gain(POLE); total = sum_of([1; 1]);
    s2 = product([1; 1]); m_s2 = gain(POLE); inertia = sum_of([1; 1]); cart = block("CONST_m", text(CART));
    a = product([1; -1]); a_cos = product([1; 1]); difference = sum_of([1; -1]); alpha = gain(1 / LENGTH);
    state = block("MUX", "4"); regulator = gain(-K);
    hold = block("SAMPHOLD_m", "1");
    connect(ticks(PERIOD), 1, hold, 1, -1);
    wire(p, [state 1]);
    wire(theta, [state 2, s 1, c 1]);
    wire(v, [p 1, state 3]);
    wire(omega, [theta 1, state 4, omega2 1, omega2 2]);
    wire(omega2, [l_omega2 1]);
    wire(l_omega2, [pull 1]);
    wire(g_cos, [pull 2]);
    wire(pull, [s_pull 1]);
    wire(s, [s_pull 2, s2 1, s2 2, g_sin 1]);
    wire(c, [g_cos 1, a_cos 2]);
    wire(s_pull, [m_s_pull 1]);
    wire(m_s_pull, [total 1]);
    wire(s2, [m_s2 1]);
    wire(m_s2, [inertia 1]);
    wire(cart, [inertia 2]);
    wire(total, [a 1]);
    wire(inertia, [a 2]);
    wire(a, [v 1, a_cos 1]);
    wire(g_sin, [difference 1]);
    wire(a_cos, [difference 2]);
    wire(difference, [alpha 1]);
    wire(alpha, [omega 1]);
    wire(state, [regulator 1]);
    wire(regulator, [hold 1]);
    wire(hold, [total 2]);
endfunction

solver = 0;
if CASE == "cartpole" then observed = cart_pole(); solver = 6; else observed = chain(); end
tol = [1e-9; 1e-9; 1e-10; 1e6; 0; solver; H];
startup_s = timer();
scheduled = xcos_compile(scs_m);
compile_s = timer();
sim = scheduled.sim;
port = sim("outlnk")(sim("outptr")(scheduled.cor(observed)));

function state = advance(n)
    tf = (n - 0.5) * H;
    [state, t] = scicosim(scheduled.state, 0, tf, sim, "start", tol);
    [state, t] = scicosim(state, 0, tf, sim, "run", tol);
    reached = state;
    [ended, t] = scicosim(state, tf, tf, sim, "finish", tol);
    state = reached;
endfunction

state = advance(CHECK_STEPS);
check = state.outtb(port)(1);
fastest = %inf;
for i = 1:REPEATS
    timer();
    advance(STEPS);
    fastest = min(fastest, timer());
end
mprintf("{""step_ns"": %.6e, ""startup_s"": %.4f, ""compile_s"": %.4f, ""check"": %.15f}\n", fastest / STEPS * 1e9, startup_s, compile_s, check);
exit(0);
