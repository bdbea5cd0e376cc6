# The heavy top by TITLE: requests on standard input, answers on standard output.

# Ω' and γ' of M' = M × Ω + P γ × r, γ' = γ × Ω; M = IΩ, n = P r; ξ' = ξ × Ω of nine numbers, with the attitude
function field(I, n, y)
    w1, w2, w3, g1, g2, g3 = y
    rates = [
        ((I[2] - I[3]) * w2 * w3 + g2 * n[3] - g3 * n[2]) / I[1],
        ((I[3] - I[1]) * w3 * w1 + g3 * n[1] - g1 * n[3]) / I[2],
        ((I[1] - I[2]) * w1 * w2 + g1 * n[2] - g2 * n[1]) / I[3],
    ]
    for k in 4:3:length(y)
        a, b, c = y[k:k+2]
        append!(rates, [b * w3 - c * w2, c * w1 - a * w3, a * w2 - b * w1])
    end
    return rates
end

# METHOD

# answers a request: a state for each time, then done
function run(given)
    I, n, y, times = (given[name] for name in ("inertia", "moment", "state", "times"))
    control = haskey(given, "setting") ? given["setting"][1] : CONTROL
    evaluations = 0
    f = z -> (evaluations += 1; field(I, n, z))
    time, steps, memory = 0.0, 0, Dict{String,Any}()
    for last in times[2:end]
        y, taken = advance(f, y, last - time, control, memory)
        if taken < 0
            println("failed step too small after time ", time)
            return
        end
        time, steps = last, steps + taken
        println("state ", time, " ", join(y, " "))
        flush(stdout)
    end
    println("done steps ", steps, " evaluations ", evaluations)
end

function main()
    given = Dict{String,Vector{Float64}}()
    for line in eachline(stdin)
        name, words... = split(line)
        if name == "heavytop-integrator"
            println("ready mine 1.0")
        elseif name == "go"
            run(given)
            empty!(given)
        elseif name == "quit"
            break
        else
            given[name] = [x for x in tryparse.(Float64, words) if x !== nothing]
        end
        flush(stdout)
    end
end

main()
